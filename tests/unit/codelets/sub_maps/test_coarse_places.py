"""Coarse maps: the root map's places on coarser grids, around the agent and block by block."""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import NoSettings
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Operation
from cogmap.schemas.nodes import ROOT_MAP, Map, PlaceColumn, coarse_map_id
from cogmap.services.codelets.sub_maps.coarse_places import EVERY_CYCLES, run
from cogmap.testing import agent, graph_of, task

CONFIG = NoSettings()
FINER, COARSEST = coarse_map_id(1), coarse_map_id(2)


def _cells(
    column: PlaceColumn, i: tuple[int, int], j: tuple[int, int], value: float = 1.0
) -> Cells:
    """A value of a rectangle of the root map's cells: from and to i, from and to j."""
    grid = np.mgrid[i[0] : i[1] + 1, j[0] : j[1] + 1]
    cells = grid.reshape(2, -1).T
    values = np.full(len(cells), value, np.float32)
    return Cells(column=column, cells=Array.of(cells, "<i4"), values=Array.of(values))


def _coarsened(*operations: Operation, updates: int = 1) -> Graph:
    """The graph after the maps have been made, and so many updates of them."""
    graph = graph_of(agent(), *operations)
    asked = task("coarse_places")
    for number in range(updates + 1):
        each = msgspec.structs.replace(asked, cycle=number * EVERY_CYCLES)
        graph.change(run(each, graph, CONFIG).operations)
    return graph


def _value(graph: Graph, map_id: str, i: int, j: int, column: PlaceColumn) -> float | None:
    return graph.places.value(map_id, i, j, column)


def test_each_map_is_three_times_as_coarse_as_the_one_below() -> None:
    graph = _coarsened()

    assert graph.cell_m(FINER) == 3.0
    assert graph.cell_m(COARSEST) == 9.0
    assert {node.parent for node in graph.of_kind(Map)} == {"", ROOT_MAP}


def test_a_place_is_road_where_any_place_in_it_is() -> None:
    graph = _coarsened(_cells(PlaceColumn.ROAD, (7, 7), (-5, -5), 0.8))

    # Cells 6 to 8 are the third of threes, and -6 to -4 those two below the middle.
    assert _value(graph, FINER, 2, -2, PlaceColumn.ROAD) == np.float32(0.8)
    assert _value(graph, FINER, 3, -2, PlaceColumn.ROAD) == 0.0
    assert _value(graph, COARSEST, 1, -1, PlaceColumn.ROAD) == np.float32(0.8)


def test_a_wall_cuts_the_links_that_cross_it_on_every_level_and_a_gap_opens_them() -> None:
    wall = _cells(PlaceColumn.OBSTACLE, (12, 12), (-30, 30))
    closed = _coarsened(wall)
    gap = _cells(PlaceColumn.OBSTACLE, (12, 12), (-1, 1), 0.0)
    opened = _coarsened(wall, gap)

    for graph, weight in ((closed, 0.0), (opened, 1.0)):
        assert _value(graph, FINER, 3, 0, PlaceColumn.WEIGHT_E) == weight
        assert _value(graph, COARSEST, 1, 0, PlaceColumn.WEIGHT_E) == weight

    assert _value(opened, FINER, 3, 4, PlaceColumn.WEIGHT_E) == 0.0
    assert _value(closed, FINER, 2, 0, PlaceColumn.WEIGHT_N) in (None, 1.0)


def test_links_that_are_cut_stay_cut_though_nothing_stands_there() -> None:
    graph = _coarsened(_cells(PlaceColumn.WEIGHT_N, (-30, 30), (4, 4), 0.0))

    assert _value(graph, FINER, 0, 1, PlaceColumn.WEIGHT_N) == 0.0
    assert _value(graph, FINER, 0, 2, PlaceColumn.WEIGHT_N) == 1.0
    assert _value(graph, FINER, 0, 1, PlaceColumn.WEIGHT_E) == 1.0


def test_what_is_far_from_the_agent_is_reached_block_by_block() -> None:
    far = _cells(PlaceColumn.ROAD, (400, 410), (300, 310))
    near = _cells(PlaceColumn.ROAD, (0, 10), (0, 10))
    once = _coarsened(near, far)
    often = _coarsened(near, far, updates=12)

    assert not _value(once, COARSEST, 45, 34, PlaceColumn.ROAD)
    assert _value(often, COARSEST, 45, 34, PlaceColumn.ROAD) == 1.0


def test_nothing_is_written_where_nothing_has_changed() -> None:
    graph = _coarsened(_cells(PlaceColumn.ROAD, (0, 10), (0, 10)))

    assert run(task("coarse_places"), graph, CONFIG).operations == []
