"""Builders have usual values for what a test is not about."""

from __future__ import annotations

import math

import pytest

from cogmap.schemas.nodes import ROOT_MAP, Node, Object, PlaceColumn, object_id
from cogmap.testing import (
    Observer,
    agent,
    broadcast,
    cells,
    context,
    graph_of,
    landmark,
    percept_at,
    percepts,
    range_scan,
    run_codelet,
    stamp_ns,
    task,
)
from examples.trip_codelet import trip_codelet


def test_a_graph_has_a_root_map_and_what_it_is_made_of() -> None:
    graph = graph_of(agent(), landmark("bakery", [(3.0, 4.0), (5.0, 4.0)]))

    assert graph.agent is not None
    found = graph.get(Object, object_id("bakery"))
    assert found is not None
    assert (found.x_m, found.y_m) == (4.0, 4.0)


def test_place_nodes_are_written_by_cell() -> None:
    graph = graph_of(cells(PlaceColumn.ROAD, {(0, 0): 1.0, (-2, 3): 0.5}))

    assert graph.places.value(ROOT_MAP, -2, 3, PlaceColumn.ROAD) == 0.5


def test_what_stands_to_the_left_is_seen_to_the_left() -> None:
    facing_north = (1.0, 2.0, math.pi / 2)

    seen = percept_at(facing_north, "mill", (-4.0, 2.0))

    assert (seen.bearing_rad, seen.range_m) == pytest.approx((math.pi / 2, 5.0))


def test_a_scan_has_its_rays_and_the_time_of_its_view() -> None:
    scan = range_scan((0.1, 6.0), (-0.1, 0.0), frame=3)

    assert scan.stamp_ns == stamp_ns(3)
    assert scan.range_m.numpy().tolist() == [6.0, 0.0]


def test_a_codelet_runs_on_a_graph_by_hand() -> None:
    seen = percepts(0)
    (asked,) = trip_codelet.due(context(seen), graph_of(), trip_codelet.Config())

    answer = run_codelet(trip_codelet.CODELET, asked, graph_of())

    (trip,) = answer.operations
    assert isinstance(trip, Node)
    assert trip.attributes["distance_m"] == pytest.approx(0.4)


def test_a_task_is_of_the_first_cycle() -> None:
    asked = task("boundary")

    assert (asked.task_id, asked.cycle, asked.version) == ("1/boundary", 1, 1)


def test_an_observer_keeps_what_it_is_asked_to() -> None:
    observer = Observer()

    assert observer.last(Node) is None
    assert observer.of(Node) == []
    assert broadcast(agent()).coalition.codelet == "test"
