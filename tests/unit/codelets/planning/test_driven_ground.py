"""Ground that the agent has driven over: free, whatever edge is mapped there since."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.graph.window import WEIGHT_COLUMNS
from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import ROOT_MAP, Map, PathColumn, PathSegment, PlaceColumn, segment_id
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.place_cost import PlaceCosts, place_costs
from cogmap.testing import agent
from tests.support.world.street_loop import block_of

LENGTH_M = 20
EDGE_I = 10


def _driven_street() -> Graph:
    """A street along x, on whose middle the agent drove; an edge is mapped across it."""
    graph = Graph()
    rows = np.zeros((LENGTH_M, len(PathColumn)))
    rows[:, PathColumn.X_M] = np.arange(LENGTH_M)
    path = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))
    graph.change([Map(id=ROOT_MAP, cell_m=1.0), agent(x_m=LENGTH_M - 1.0), path])

    graph.change([block_of(PlaceColumn.ROAD, range(LENGTH_M), range(-3, 4), 1.0)])
    for column in WEIGHT_COLUMNS:
        graph.change([block_of(column, range(EDGE_I, EDGE_I + 1), range(-4, 5), 0.0)])
    return graph


def _ground(graph: Graph) -> PlaceCosts:
    assert graph.agent is not None
    return place_costs(graph, graph.agent, Config())


def _is_free(around: PlaceCosts, i: int, j: int) -> bool:
    return bool(around.is_free[tuple(np.array((i, j)) - around.grid.origin)])


def test_what_the_agent_drove_over_is_free_though_an_edge_is_mapped_across_it() -> None:
    around = _ground(_driven_street())

    assert _is_free(around, EDGE_I, 0)
    assert not _is_free(around, EDGE_I, 3)


@pytest.mark.parametrize("beside", [range(0, 1), range(-1, 2)])
def test_it_is_not_free_where_something_stands_there_by_now(beside: range) -> None:
    graph = _driven_street()
    graph.change([block_of(PlaceColumn.OBSTACLE, range(EDGE_I, EDGE_I + 1), beside, 1.0)])

    assert not _is_free(_ground(graph), EDGE_I, 0)


def test_a_narrow_gap_between_what_stands_there_by_now_is_not_free() -> None:
    graph = _driven_street()
    for side in (range(-3, 0), range(1, 4)):
        graph.change([block_of(PlaceColumn.OBSTACLE, range(EDGE_I, EDGE_I + 1), side, 1.0)])

    assert not _is_free(_ground(graph), EDGE_I, 0)
