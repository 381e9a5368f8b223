"""Place nodes of a grid with a frame of its own, from those of the root map. Pure.

Everything is in cells of the root map. A cell of the grid is at least as large as one of those.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.geometry.se2 import rotate, transform_from
from cogmap.graph.window import (
    EVIDENCE_COLUMNS,
    LINK_OFFSETS,
    WEIGHT_COLUMNS,
    Extent,
    Window,
)
from cogmap.schemas.nodes import PlaceColumn
from cogmap.services.codelets.sub_maps.coarsening import places_of

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *WEIGHT_COLUMNS, *EVIDENCE_COLUMNS)
BESIDE = 2
"""Cells around a rectangle that its links lead to or past."""

ROUNDING = 1e-6
"""In cells: more than rounding errors, less than matters to a place."""


class Grid(NamedTuple):
    """Cells (i, j) that are `side` wide, in a frame with a pose (3,) in the root map."""

    pose: Floats
    side: float

    def placed(self, cells: Floats) -> Floats:
        """Compute where on the root map (..., 2) cells are, (..., 2)."""
        return transform_from(self.pose, self.side * cells)

    def turned(self, cells: Floats) -> Floats:
        """Compute what (..., 2) steps from cell to cell are on the root map, (..., 2)."""
        return rotate(self.side * cells, self.pose[2])

    @property
    def parts(self) -> int:
        """Count the parts of a cell's side, each at most a cell of the root map wide."""
        return _parts(self.side)

    @property
    def middles(self) -> Floats:
        """Return where in a cell the middles of its parts are, from its own middle, (parts,)."""
        middles: Floats = (np.arange(self.parts) + 0.5) / self.parts - 0.5
        return middles


def cells_below(grid: Grid, extent: Extent) -> Extent:
    """Find the cells of the root map that those of a rectangle are computed from."""
    wide = extent.grown(BESIDE)
    (low_i, low_j), (high_i, high_j) = wide.lower, wide.upper
    corners = [[low_i, low_j], [low_i, high_j], [high_i, low_j], [high_i, high_j]]
    placed = grid.placed(np.array(corners, np.float64))

    first_i, first_j = np.floor(placed.min(axis=0)).astype(int).tolist()
    last_i, last_j = np.ceil(placed.max(axis=0)).astype(int).tolist()
    return Extent((first_i, first_j), (last_i + 1, last_j + 1))


def resampled(window: Window, grid: Grid, extent: Extent) -> Singles:
    """Compute the COLUMNS of a rectangle of the grid's cells, (10, w, h), from a window of the root
    map with the cells below.

    A cell is as much road as the most road-like place in it, and as much an obstacle as its places
    are on average. A link is as free as the best of the rows of links that lead to the neighbour's
    middle, and a row as its weakest link; so is its evidence. Diagonally there is one row;
    otherwise there are as many as places beside each other in a cell, each leading aside, along the
    link, and back. So no route over the grid crosses what no route over the root map crosses. No
    link leads to where something stands.
    """
    places = _PlacesBelow(window, grid, extent)
    road = window.column(PlaceColumn.ROAD)
    obstacle = window.column(PlaceColumn.OBSTACLE)
    weights = window.weights()
    is_open = places_of(road, obstacle, weights).is_open
    free = np.where(is_open, weights, np.float32(0.0))

    inside = places.inside()
    steps = [places.steps(offset) for offset in LINK_OFFSETS]
    columns: list[Singles] = [
        road.take(inside).max(axis=-1),
        obstacle.take(inside).mean(axis=-1),
        *(each.best(free, 1.0) for each in steps),
        *(each.best(window.evidence(), 0.0) for each in steps),
    ]
    return np.stack(columns)


class _Steps(NamedTuple):
    """Steps between places of the root map, (w, h, rows, steps): which link each takes, of all in
    (4, ...) arrays, and which steps stay in one place.
    """

    link: Indices
    is_still: Booleans

    def best(self, values: Singles, within: float) -> Singles:
        """Find the greatest of the rows' least values of links, (4, ...), of each cell, (w, h); it
        is `within` if a row stays in one place.
        """
        taken = values.take(self.link)
        taken[self.is_still] = np.inf
        best = taken.min(axis=-1).max(axis=-1)
        best[np.isinf(best)] = within
        return np.asarray(best)


class _PlacesBelow:
    """The places of a window of the root map below a rectangle of a grid's cells."""

    def __init__(self, window: Window, grid: Grid, extent: Extent) -> None:
        columns = slice(extent.lower[0], extent.upper[0])
        rows = slice(extent.lower[1], extent.upper[1])
        cells = np.moveaxis(np.mgrid[columns, rows], 0, -1).astype(np.float64)

        # Of two cells as near it is always the upper one, so that points in a row miss none.
        self._points = grid.placed(cells) - window.origin + (0.5 + ROUNDING)
        self._grid = grid
        self._shape = window.shape

    def inside(self) -> Indices:
        """Return the places in each cell, as numbers in flat columns, (w, h, parts ** 2)."""
        middles = self._grid.middles
        offsets = np.stack(np.meshgrid(middles, middles), axis=-1)
        i, j = self._nearest(offsets.reshape(-1, 2))
        numbers: Indices = i * self._shape[1] + j
        return numbers

    def steps(self, offset: Indices) -> _Steps:
        """Find the steps of all rows along the links of the cells in one direction."""
        # Along neither axis of the root map does a step lead farther than to the next cell.
        along = self._grid.turned(offset.astype(np.float64))
        parts = _parts(float(np.abs(along).max()))
        is_diagonal = bool(offset.all())
        asides = np.zeros(1) if is_diagonal else self._grid.middles
        i, j = self._nearest(_rows(offset, asides, parts))

        _, height = self._shape
        place = i * height + j
        code = 3 * _step(i) + _step(j)
        owner = np.where(_IS_BACK[code], place[..., 1:], place[..., :-1])
        return _Steps(_LINK[code] * math.prod(self._shape) + owner, code == _STILL)

    def _nearest(self, offsets: Floats) -> tuple[Indices, Indices]:
        """Find the indices, (w, h, ...) each, of the places at (..., 2) offsets in each cell."""
        width, height, _ = self._points.shape
        turned = self._grid.turned(offsets)
        added = (1,) * (turned.ndim - 1)
        points = self._points.reshape(width, height, *added, 2)

        i = np.floor(points[..., 0] + turned[..., 0])
        j = np.floor(points[..., 1] + turned[..., 1])
        return i.astype(np.int64), j.astype(np.int64)


def _parts(length: float) -> int:
    """Return into how many parts of at most 1 a length is divided."""
    return max(1, math.ceil(length - ROUNDING))


def _rows(offset: Indices, asides: Floats, parts: int) -> Floats:
    """Compute the points of rows from the middle of a cell to that of the one at `offset`,
    (rows, n, 2). Rows lead aside, along in so many parts, and back.
    """
    along = np.arange(parts + 1) / parts
    # No row is farther aside than half a cell.
    steps = math.ceil(parts / 2) if len(asides) > 1 else 0
    across = np.arange(steps) / max(1, steps)
    how_far = np.concatenate([np.zeros(len(across)), along, np.ones(len(across))])
    how_wide = np.concatenate([across, np.ones(len(along)), across[::-1]])

    beside = np.array([-offset[1], offset[0]])
    rows: Floats = (asides[:, None] * how_wide)[..., None] * beside
    return rows + how_far[:, None] * offset


def _step(cells: Indices) -> Indices:
    """Compare each of n cells in a row to the next, (..., n - 1): 2 before it, 1 as it, 0 after."""
    return np.diff(cells).clip(-1, 1) + 1


def _links_by_step() -> tuple[Indices, Booleans]:
    """Return, by how a step leads along both axes, the number of the link that it takes, and
    whether that belongs to the place where the step ends, (9,) each.
    """
    link = np.zeros(9, np.int64)
    is_back = np.zeros(9, bool)
    for number, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        ahead = 3 * (di + 1) + dj + 1
        link[[ahead, 2 * _STILL - ahead]] = number
        is_back[2 * _STILL - ahead] = True

    return link, is_back


# The code of a step that stays in one place: 1 as it, along both axes, so 3 * 1 + 1.
_STILL = 4
_LINK, _IS_BACK = _links_by_step()
