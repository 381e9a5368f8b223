"""The codelet by hand: its tasks, and its answer on a graph."""

from __future__ import annotations

import pytest
from trip_codelet import CODELET, TRIP, Config, due

from cogmap import Graph
from cogmap.schemas.nodes import Node
from cogmap.testing import context, graph_of, run_codelet


def distance_m(graph: Graph, config: Config) -> float:
    """Return what the codelet makes of 0.2 s at 2 m/s."""
    (asked,) = due(context(rows=[(2.0, 0.0, 0.2, 0.1, 0.01)]), graph, config)
    (trip,) = run_codelet(CODELET, asked, graph, config).operations
    assert isinstance(trip, Node)
    return float(trip.attributes["distance_m"])


def test_the_distance_of_a_cycle_is_added_to_that_before() -> None:
    before = Node(id=TRIP, kind=TRIP, attributes={"distance_m": 1.0})

    assert distance_m(graph_of(before), Config()) == pytest.approx(1.4)


def test_an_agent_slower_than_the_threshold_stands() -> None:
    assert distance_m(graph_of(), Config(min_speed_m_s=3.0)) == 0.0
