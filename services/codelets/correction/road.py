"""The road of a map, moved with the path as a correction states."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import move_with
from cogmap.graph.graph import Graph
from schemas.array import Array
from schemas.graph import Cells, Operation
from schemas.nodes import ROOT_MAP, PlaceColumn

NEIGHBOURHOOD = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
MAX_CELLS = 2**16

Cell = tuple[int, int]
RoadShares = dict[Cell, float]


def move_road(graph: Graph, old: Floats, new: Floats) -> list[Operation]:
    """Move each road node with the place of the path nearest to it, from (n, 3) `old` poses to
    `new`, and fill the gaps that a turn would leave between them.
    """
    cells, shares = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    if not len(cells):
        return []

    cell_m = graph.cell_m()
    before = dict(zip(_keys(cells), shares.tolist(), strict=True))
    arrived = _moved_cells(cells, old, new, cell_m)
    around = _neighbourhood(arrived)
    origins = _moved_cells(around, new, old, cell_m)

    after = dict.fromkeys(before, 0.0)
    _fill_gaps(after, around, origins, before)
    _raise_shares(after, arrived, shares.tolist())
    return _written(_changed(before, after))


def _moved_cells(cells: Indices, old: Floats, new: Floats, cell_m: float) -> Indices:
    """(k, 2) cells, each moved as the pose nearest to it is, from (n, 3) `old` to `new`."""
    points_m = cells.astype(np.float64) * cell_m
    tree = cKDTree(old[:, :2])
    _, nearest = tree.query(points_m)
    before = old[nearest]
    after = new[nearest]

    moved_m = move_with(points_m, before, after)
    moved_cells = np.rint(moved_m / cell_m)
    return moved_cells.astype(np.int64)


def _neighbourhood(cells: Indices) -> Indices:
    """(k, 2): the cells and their eight neighbours each, without repetition."""
    neighbours = cells[:, None, :] + NEIGHBOURHOOD
    cells_of_all = neighbours.reshape(-1, 2)
    around: Indices = np.unique(cells_of_all, axis=0)
    return around


def _keys(cells: Indices) -> list[Cell]:
    keys = []
    for i, j in cells.tolist():
        keys.append((i, j))

    return keys


def _fill_gaps(road: RoadShares, around: Indices, origins: Indices, before: RoadShares) -> None:
    """Raise the shares of (k, 2) cells `around` to those that their (k, 2) `origins` had before."""
    origin_shares = [before.get(origin, 0.0) for origin in _keys(origins)]
    shares = np.array(origin_shares)
    was_road = shares > 0

    _raise_shares(road, around[was_road], shares[was_road].tolist())


def _raise_shares(road: RoadShares, cells: Indices, shares: Iterable[float]) -> None:
    """Raise the shares of (k, 2) cells of `road` to `shares` where these are larger."""
    for cell, share in zip(_keys(cells), shares, strict=True):
        known = road.get(cell, 0.0)
        road[cell] = max(known, share)


def _changed(before: RoadShares, after: RoadShares) -> RoadShares:
    """The cells whose share is not what it was before."""
    changed = {}
    for cell, share in after.items():
        if share != before.get(cell, 0.0):
            changed[cell] = share

    return changed


def _written(road: RoadShares) -> list[Operation]:
    """New shares of road nodes, at most as many at once as the workspace takes."""
    cells = np.array(list(road), np.int32).reshape(-1, 2)
    shares = np.array(list(road.values()), np.float32)

    parts: list[Operation] = []
    for start in range(0, len(cells), MAX_CELLS):
        some = slice(start, start + MAX_CELLS)
        part = Cells(
            map=ROOT_MAP,
            column=PlaceColumn.ROAD,
            cells=Array.of(cells[some]),
            values=Array.of(shares[some]),
        )
        parts.append(part)

    return parts
