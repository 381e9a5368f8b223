"""A loop of four streets between obstacles, as place nodes of a map."""

from __future__ import annotations

import numpy as np

from cogmap.graph.graph import Graph
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, Map, PlaceColumn
from cogmap.testing import agent

SOUTH = (0, 60, -3, 3)
EAST = (54, 60, -3, 43)
NORTH = (0, 60, 37, 43)
WEST = (0, 6, -3, 43)


def road(*streets: tuple[int, int, int, int]) -> Cells:
    """Streets as rectangles of cells: from and to i, from and to j."""
    parts = []
    for i0, i1, j0, j1 in streets:
        i, j = np.mgrid[i0 : i1 + 1, j0 : j1 + 1]
        parts.append(np.column_stack([i.ravel(), j.ravel()]))

    cells = np.unique(np.vstack(parts), axis=0)
    return cells_of(PlaceColumn.ROAD, cells, 1.0)


def cells_of(
    column: PlaceColumn, cells: np.ndarray[tuple[int, ...], np.dtype[np.int64]], value: float
) -> Cells:
    """One value in a column of (n, 2) cells."""
    values = np.full(len(cells), value, np.float32)
    return Cells(column=column, cells=Array.of(cells, "<i4"), values=Array.of(values))


def block_of(column: PlaceColumn, i: range, j: range, value: float) -> Cells:
    """One value in a column of a rectangle of cells."""
    grid = np.meshgrid(np.arange(i.start, i.stop), np.arange(j.start, j.stop), indexing="ij")
    return cells_of(column, np.column_stack([axis.ravel() for axis in grid]), value)


def barrier(i: int, j: int) -> Cells:
    """Obstacles across a street that leads along x, at column i around row j."""
    rows = np.arange(j - 4, j + 5)
    return cells_of(PlaceColumn.OBSTACLE, np.column_stack([np.full(len(rows), i), rows]), 1.0)


def _walls() -> list[Operation]:
    """Obstacles everywhere but on the loop of streets."""
    i, j = np.mgrid[-32:96, -32:96]
    is_road = np.zeros(i.shape, bool)
    for i0, i1, j0, j1 in (SOUTH, EAST, NORTH, WEST):
        is_road |= (i >= i0) & (i <= i1) & (j >= j0) & (j <= j1)

    cells = np.column_stack([i[~is_road], j[~is_road]])
    return [cells_of(PlaceColumn.OBSTACLE, cells, 1.0)]


def loop(*more: Operation) -> Graph:
    """A loop of four streets, 54 m and 40 m long, with the agent in its south-west corner."""
    graph = Graph()
    first: list[Operation] = [Map(id=ROOT_MAP, cell_m=1.0), agent(x_m=3.0)]
    graph.change([*first, road(SOUTH, EAST, NORTH, WEST), *_walls(), *more])
    return graph
