"""The grid of one sub-map: its cells, their blocks, and what changes in them."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.graph.graph import Graph
from cogmap.graph.window import Extent
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import ROOT_MAP, Map
from cogmap.services.codelets.cells import changed_cells
from cogmap.services.codelets.sub_maps.areas import COARSEST
from cogmap.services.codelets.sub_maps.members import is_sub_map, pose_of, sub_maps_of
from cogmap.services.codelets.sub_maps.resampling import COLUMNS, Grid, cells_below, resampled

BLOCK = 48
"""The cells of the root map along the side of a block."""


SETTLED_CYCLES = 25
"""A frame that is younger may well change again, and its places with it."""


def with_places(graph: Graph, cycle: int) -> list[Map]:
    """Return the sub-maps that have place nodes in a cycle, by number: their frame has settled, and
    their cells are neither smaller than the root map's nor larger than a sub-map's ever are.
    """
    root_cell_m = graph.cell_m()
    return [node for node in sub_maps_of(graph) if _has_places(node, root_cell_m, cycle)]


def any_with_places(graph: Graph, cycle: int) -> bool:
    """Return whether any sub-map has place nodes in a cycle, found without visiting all."""
    root_cell_m = graph.cell_m()
    return any(
        is_sub_map(node) and _has_places(node, root_cell_m, cycle) for node in graph.of_kind(Map)
    )


def _has_places(node: Map, root_cell_m: float, cycle: int) -> bool:
    is_settled = cycle - node.cycle >= SETTLED_CYCLES
    return is_settled and root_cell_m <= node.cell_m <= root_cell_m * 2**COARSEST


def area_of(node: Map) -> Extent:
    """Return the cells of a sub-map whose middles lie in its area."""
    high_i = math.floor(node.width_m / 2 / node.cell_m)
    high_j = math.floor(node.height_m / 2 / node.cell_m)
    return Extent((-high_i, -high_j), (high_i + 1, high_j + 1))


def cells_around(node: Map, position_m: Floats, reach_m: float) -> Extent:
    """Return the cells of a sub-map's area within reach of a position (2,) on the root map."""
    middle_m = transform_to(pose_of(node), position_m)
    first_i, first_j = np.floor((middle_m - reach_m) / node.cell_m).astype(int).tolist()
    last_i, last_j = np.ceil((middle_m + reach_m) / node.cell_m).astype(int).tolist()
    around = Extent((first_i, first_j), (last_i + 1, last_j + 1))
    return _overlap(around, area_of(node))


def block_count(node: Map, graph: Graph) -> int:
    """Return how many blocks cover the area of a sub-map."""
    columns, rows = _blocks(node, graph)
    return columns * rows


def block(node: Map, number: int, graph: Graph) -> Extent:
    """Return the cells of one block, by its number from 0."""
    side = _block_side(node, graph)
    area = area_of(node)
    _, rows = _blocks(node, graph)
    column, row = divmod(number, rows)

    first_i = area.lower[0] + side * column
    first_j = area.lower[1] + side * row
    return _overlap(Extent((first_i, first_j), (first_i + side, first_j + side)), area)


def updated(node: Map, extent: Extent, graph: Graph) -> list[Operation]:
    """Write the places of a sub-map that change in a rectangle of its area."""
    if not all(extent.shape):
        return []

    root_cell_m = graph.cell_m()
    pose = pose_of(node)
    pose[:2] /= root_cell_m
    grid = Grid(pose, node.cell_m / root_cell_m)
    window = graph.places.window(ROOT_MAP, COLUMNS, cells_below(grid, extent))
    known = graph.places.window(node.id, COLUMNS, extent)
    return changed_cells(node.id, known, resampled(window, grid, extent))


def _block_side(node: Map, graph: Graph) -> int:
    """Return how many cells of a sub-map lie along the side of a block."""
    return max(1, int(BLOCK * graph.cell_m() / node.cell_m))


def _blocks(node: Map, graph: Graph) -> tuple[int, int]:
    """Return how many blocks stand side by side in each direction."""
    side = _block_side(node, graph)
    width, height = area_of(node).shape
    return math.ceil(width / side), math.ceil(height / side)


def _overlap(a: Extent, b: Extent) -> Extent:
    """Return the cells that are in both."""
    first_i, first_j = np.maximum(a.lower, b.lower).tolist()
    last_i, last_j = np.minimum(a.upper, b.upper).tolist()
    return Extent((first_i, first_j), (last_i, last_j))
