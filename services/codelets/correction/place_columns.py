"""The place nodes of a map, moved with the path as a correction states: road, obstacles, and the
evidence and weights of links.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import move_with, rotate
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import ROOT_MAP, PlaceColumn
from cogmap.services.codelets.cells import written_cells
from cogmap.services.codelets.mapping.evidence import weights_of

SHARE_COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE)
MOVED_COLUMNS = (*SHARE_COLUMNS, *EVIDENCE_COLUMNS, *WEIGHT_COLUMNS)
NEIGHBOURHOOD = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
OCTANT_RAD = np.pi / 4
# More than there are cells along an axis: the workspace takes none beyond 2^20.
_KEY_STEP = 2**32
_DIRECTIONS = len(LINK_OFFSETS)


class Movement:
    """How points move with the place of the path nearest to them, from (n, 3) `old` poses to `new`.
    Positions are in cells.
    """

    def __init__(self, old: Floats, new: Floats, cell_m: float) -> None:
        self._old = old
        self._new = new
        self._cell_m = cell_m
        self._tree = cKDTree(old[:, :2])

    def back(self) -> Movement:
        """Return the movement from the new poses to the old ones."""
        return Movement(self._new, self._old, self._cell_m)

    def moved(self, positions: Floats) -> tuple[Floats, Floats]:
        """Move (k, 2) positions. Return them, and by how much each is turned, (k,)."""
        points_m = positions * self._cell_m
        _, nearest = self._tree.query(points_m)
        before = self._old[nearest]
        after = self._new[nearest]

        moved_m = move_with(points_m, before, after)
        return moved_m / self._cell_m, after[:, 2] - before[:, 2]


class CellLinks(NamedTuple):
    """CellLinks by the direction, (k,), and the cell, (k, 2), that each belongs to."""

    direction: Indices
    cells: Indices

    def keys(self) -> Indices:
        """Return a number for each link, (k,)."""
        return _keys(self.cells) * _DIRECTIONS + self.direction

    def moved(self, movement: Movement) -> CellLinks:
        """Find the links nearest to where these move to."""
        offsets = LINK_OFFSETS[self.direction]
        middles, turned_rad = movement.moved(self.cells + offsets / 2)

        along = rotate(offsets.astype(np.float64), turned_rad)
        heading_rad = np.arctan2(along[:, 1], along[:, 0])
        octant = np.rint(heading_rad / OCTANT_RAD).astype(np.int64)
        direction = octant % _DIRECTIONS

        cells = np.rint(middles - LINK_OFFSETS[direction] / 2)
        return CellLinks(direction, cells.astype(np.int64))

    def neighbourhood(self) -> CellLinks:
        """Return these links and those of their direction in the eight cells around, once each."""
        cells = self.cells[:, None, :] + NEIGHBOURHOOD
        direction = np.repeat(self.direction, len(NEIGHBOURHOOD))
        links = CellLinks(direction, cells.reshape(-1, 2))
        return CellLinks.of(_once_each(links.keys()))

    @classmethod
    def of(cls, keys: Indices) -> CellLinks:
        """Return the links with these numbers."""
        cell_keys, direction = np.divmod(keys, _DIRECTIONS)
        return cls(direction, _cells(cell_keys))


class Known:
    """The (n,) values at (n,) numbers of cells or links; 0 at any other."""

    def __init__(self, keys: Indices, values: Floats) -> None:
        order = np.argsort(keys)
        self.keys = keys[order]
        self._values = values[order]

    def values_at(self, keys: Indices) -> Floats:
        """Return the values at these numbers, (k,)."""
        last = len(self.keys) - 1
        place = np.searchsorted(self.keys, keys).clip(0, last)
        is_known = self.keys[place] == keys

        found: Floats = np.where(is_known, self._values[place], 0.0)
        return found


class Merged(NamedTuple):
    """All numbers of cells or links that a movement concerns, (n,), and which of them those around
    are, (a,), and those where something arrives, (k,).
    """

    keys: Indices
    around: Indices
    arrived: Indices

    @classmethod
    def of(cls, known: Known, around: Indices, arrived: Indices) -> Merged:
        """Merge those that are known, those around and those where something arrives."""
        every = np.concatenate([known.keys, around, arrived])
        keys, place = np.unique(every, return_inverse=True)
        ends = np.cumsum([len(known.keys), len(around)])
        _, at_around, at_arrived = np.split(place, ends)
        return cls(keys, at_around, at_arrived)


def move_places(graph: Graph, old: Floats, new: Floats) -> list[Operation]:
    """Move what is known of the root map's place nodes with the place of the path nearest to each,
    from (n, 3) `old` poses to `new`, and fill the gaps that a turn would leave between them.
    """
    movement = Movement(old, new, graph.cell_m())

    operations: list[Operation] = []
    for column in SHARE_COLUMNS:
        operations += _move_shares(graph, column, movement)
    operations += _move_links(graph, movement)
    return operations


def _move_shares(graph: Graph, column: PlaceColumn, movement: Movement) -> Iterator[Operation]:
    """Move the shares of cells; if several move to one, it has the largest."""
    cells, shares = graph.places.written_cells(ROOT_MAP, column)
    if not len(cells):
        return

    known = Known(_keys(cells), shares)
    arrived = _nearest_cells(movement, cells)
    neighbours = arrived[:, None, :] + NEIGHBOURHOOD
    around = _once_each(_keys(neighbours.reshape(-1, 2)))
    origins = _nearest_cells(movement.back(), _cells(around))
    gathered = known.values_at(_keys(origins))

    merged = Merged.of(known, around, _keys(arrived))
    after = np.zeros(len(merged.keys))
    np.maximum.at(after, merged.around, gathered)
    np.maximum.at(after, merged.arrived, shares)

    is_changed = after != known.values_at(merged.keys)
    yield from written_cells(column, _cells(merged.keys[is_changed]), after[is_changed])


def _move_links(graph: Graph, movement: Movement) -> Iterator[Operation]:
    """Move the evidence of links; if several move to one, it is cut if one of them is."""
    directions = []
    found = []
    values = []
    for direction, column in enumerate(EVIDENCE_COLUMNS):
        cells, of_column = graph.places.written_cells(ROOT_MAP, column)
        directions.append(np.full(len(cells), direction))
        found.append(cells)
        values.append(of_column)

    evidence = np.concatenate(values)
    if not len(evidence):
        return

    links = CellLinks(np.concatenate(directions), np.concatenate(found))
    known = Known(links.keys(), evidence)
    arrived = links.moved(movement)
    around = arrived.neighbourhood()
    gathered = known.values_at(around.moved(movement.back()).keys())

    # What was gathered from around; where nothing was, the strongest that arrived for free; and
    # everywhere what arrived for cut.
    merged = Merged.of(known, around.keys(), arrived.keys())
    free = np.zeros(len(merged.keys))
    np.maximum.at(free, merged.arrived, evidence)
    after = np.zeros(len(merged.keys))
    after[merged.around] = gathered
    after = np.where(after == 0, free, after)
    is_cut = evidence < 0
    np.minimum.at(after, merged.arrived[is_cut], evidence[is_cut])

    before = known.values_at(merged.keys)
    is_changed = after != before
    changed = CellLinks.of(merged.keys[is_changed])
    weights = weights_of(after[is_changed].astype(np.float32))
    has_new_weight = weights != weights_of(before[is_changed].astype(np.float32))
    for direction, column in enumerate(EVIDENCE_COLUMNS):
        is_here = changed.direction == direction
        yield from written_cells(column, changed.cells[is_here], after[is_changed][is_here])

        is_new = is_here & has_new_weight
        yield from written_cells(WEIGHT_COLUMNS[direction], changed.cells[is_new], weights[is_new])


def _nearest_cells(movement: Movement, cells: Indices) -> Indices:
    """Find the cells nearest to where the middles of (k, 2) cells move to, (k, 2)."""
    moved, _ = movement.moved(cells.astype(np.float64))
    return np.rint(moved).astype(np.int64)


def _keys(cells: Indices) -> Indices:
    """Compute a number for each of (k, 2) cells, (k,)."""
    keys: Indices = cells[:, 0] * _KEY_STEP + cells[:, 1]
    return keys


def _cells(keys: Indices) -> Indices:
    """Return the (k, 2) cells with these numbers."""
    half = _KEY_STEP // 2
    j = (keys + half) % _KEY_STEP - half
    i = (keys - j) // _KEY_STEP
    return np.column_stack([i, j])


def _once_each(keys: Indices) -> Indices:
    """Return (n,) numbers in order, each once."""
    # Without counts NumPy 2.3 and later hash them: where most differ, ten times as long.
    once, _ = np.unique(keys, return_counts=True)
    return once
