"""The place nodes of a map, moved with the path as a correction states: road, obstacles, and the
evidence and weights of links.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import move_with, rotate
from cogmap.graph.graph import Graph
from cogmap.graph.window import EVIDENCE_COLUMNS, LINK_OFFSETS, WEIGHT_COLUMNS
from schemas.array import Array
from schemas.graph import Cells, Operation
from schemas.nodes import ROOT_MAP, PlaceColumn
from services.codelets.mapping.evidence import weights_of

SHARE_COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE)
MOVED_COLUMNS = (*SHARE_COLUMNS, *EVIDENCE_COLUMNS, *WEIGHT_COLUMNS)
NEIGHBOURHOOD = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
MAX_CELLS = 2**16
OCTANT_RAD = np.pi / 4
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
        """The movement from the new poses to the old ones."""
        return Movement(self._new, self._old, self._cell_m)

    def moved(self, positions: Floats) -> tuple[Floats, Floats]:
        """(k, 2) positions moved, and by how much each is turned, (k,)."""
        points_m = positions * self._cell_m
        _, nearest = self._tree.query(points_m)
        before = self._old[nearest]
        after = self._new[nearest]

        moved_m = move_with(points_m, before, after)
        return moved_m / self._cell_m, after[:, 2] - before[:, 2]


class Links(NamedTuple):
    """Links by the direction, (k,), and the cell, (k, 2), that each belongs to."""

    direction: Indices
    cells: Indices

    def keys(self) -> Indices:
        """(k,): a number for each link."""
        return _keys(self.cells) * _DIRECTIONS + self.direction

    def moved(self, movement: Movement) -> Links:
        """The links nearest to where these move to."""
        offsets = LINK_OFFSETS[self.direction]
        middles, turned_rad = movement.moved(self.cells + offsets / 2)

        along = rotate(offsets.astype(np.float64), turned_rad)
        heading_rad = np.arctan2(along[:, 1], along[:, 0])
        octant = np.rint(heading_rad / OCTANT_RAD).astype(np.int64)
        direction = octant % _DIRECTIONS

        cells = np.rint(middles - LINK_OFFSETS[direction] / 2)
        return Links(direction, cells.astype(np.int64))

    def neighbourhood(self) -> Links:
        """These links and those of their direction in the eight cells around, once each."""
        cells = self.cells[:, None, :] + NEIGHBOURHOOD
        direction = np.repeat(self.direction, len(NEIGHBOURHOOD))
        links = Links(direction, cells.reshape(-1, 2))
        return Links.of(np.unique(links.keys()))

    @classmethod
    def of(cls, keys: Indices) -> Links:
        """The links with these numbers."""
        cell_keys, direction = np.divmod(keys, _DIRECTIONS)
        return cls(direction, _cells(cell_keys))


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
    """Where several cells move to one, it has the largest of their shares."""
    cells, shares = graph.places.written_cells(ROOT_MAP, column)
    if not len(cells):
        return

    known = _keys(cells)
    arrived = _nearest_cells(movement, cells)
    neighbours = arrived[:, None, :] + NEIGHBOURHOOD
    around = np.unique(_keys(neighbours.reshape(-1, 2)))

    origins = _nearest_cells(movement.back(), _cells(around))
    gathered = _looked_up(known, shares, _keys(origins))

    keys, where = np.unique(np.concatenate([known, around, _keys(arrived)]), return_inverse=True)
    after = np.zeros(len(keys))
    np.maximum.at(after, where[len(known) :], np.concatenate([gathered, shares]))

    before = _looked_up(known, shares, keys)
    is_changed = after != before
    yield from _written(column, _cells(keys[is_changed]), after[is_changed])


def _move_links(graph: Graph, movement: Movement) -> Iterator[Operation]:
    """Where several links move to one, it is cut if one of them is."""
    links, evidence = _links(graph)
    if not len(evidence):
        return

    known = links.keys()
    arrived = links.moved(movement)
    around = arrived.neighbourhood()
    origins = around.moved(movement.back())
    gathered = _looked_up(known, evidence, origins.keys())

    all_keys = np.concatenate([known, around.keys(), arrived.keys()])
    keys, where = np.unique(all_keys, return_inverse=True)
    after = np.zeros(len(keys))
    at_around, at_arrived = np.split(where[len(known) :], [len(gathered)])
    after[at_around] = gathered

    free = np.zeros(len(keys))
    np.maximum.at(free, at_arrived, evidence)
    after = np.where(after == 0, free, after)
    is_cut = evidence < 0
    np.minimum.at(after, at_arrived[is_cut], evidence[is_cut])

    before = _looked_up(known, evidence, keys)
    is_changed = after != before
    changed = Links.of(keys[is_changed])
    yield from _written_links(changed, before[is_changed], after[is_changed])


def _links(graph: Graph) -> tuple[Links, Floats]:
    """The links that have evidence, and the evidence, (k,)."""
    directions = []
    cells = []
    evidence = []
    for direction, column in enumerate(EVIDENCE_COLUMNS):
        found, values = graph.places.written_cells(ROOT_MAP, column)
        directions.append(np.full(len(found), direction))
        cells.append(found)
        evidence.append(values)

    return Links(np.concatenate(directions), np.concatenate(cells)), np.concatenate(evidence)


def _written_links(links: Links, before: Floats, after: Floats) -> Iterator[Operation]:
    """New evidence of links that had (k,) `before`, and their weights as far as these change."""
    weights = weights_of(after.astype(np.float32))
    has_new_weight = weights != weights_of(before.astype(np.float32))

    for direction in range(_DIRECTIONS):
        is_here = links.direction == direction
        yield from _written(EVIDENCE_COLUMNS[direction], links.cells[is_here], after[is_here])

        is_new = is_here & has_new_weight
        yield from _written(WEIGHT_COLUMNS[direction], links.cells[is_new], weights[is_new])


def _nearest_cells(movement: Movement, cells: Indices) -> Indices:
    """(k, 2): the cells nearest to where the middles of (k, 2) cells move to."""
    moved, _ = movement.moved(cells.astype(np.float64))
    return np.rint(moved).astype(np.int64)


def _keys(cells: Indices) -> Indices:
    """(k,): a number for each of (k, 2) cells."""
    keys: Indices = cells[:, 0] * _KEY_STEP + cells[:, 1]
    return keys


def _cells(keys: Indices) -> Indices:
    """(k, 2): the cells with these numbers."""
    half = _KEY_STEP // 2
    j = (keys + half) % _KEY_STEP - half
    i = (keys - j) // _KEY_STEP
    return np.column_stack([i, j])


def _looked_up(known: Indices, values: Floats, wanted: Indices) -> Floats:
    """(k,): the values at the numbers `wanted`, of those (n,) at the numbers `known`; 0 where there
    is none.
    """
    order = np.argsort(known)
    ordered = known[order]
    place = np.searchsorted(ordered, wanted).clip(0, len(known) - 1)
    is_known = ordered[place] == wanted

    found: Floats = np.where(is_known, values[order[place]], 0.0)
    return found


def _written(column: PlaceColumn, cells: Indices, values: npt.ArrayLike) -> Iterator[Operation]:
    """New values of a column, at most as many at once as the workspace takes."""
    new = np.asarray(values, np.float32)
    for start in range(0, len(cells), MAX_CELLS):
        some = slice(start, start + MAX_CELLS)
        yield Cells(
            map=ROOT_MAP,
            column=column,
            cells=Array.of(cells[some], "<i4"),
            values=Array.of(new[some]),
        )
