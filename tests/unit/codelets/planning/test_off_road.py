"""Where the agent has left the road: what counts as ground there, and the way back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.graph.window import WEIGHT_COLUMNS
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import (
    PLAN_ID,
    ROOT_MAP,
    Map,
    PathColumn,
    PathSegment,
    PlaceColumn,
    Plan,
    PlanState,
    Self,
    segment_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.place_cost import place_costs
from cogmap.services.codelets.planning.route_plan import run
from cogmap.testing import agent
from tests.support.world.street_loop import block_of

NOW_S = 1000.0
LONG_AGO_S = NOW_S - 200.0
EAST_END = 40


def _street() -> Graph:
    """A street along x with kerbs on both sides and at its west end; its east end is open."""
    graph = Graph()
    graph.change([Map(id=ROOT_MAP, cell_m=1.0)])
    graph.change([block_of(PlaceColumn.ROAD, range(EAST_END + 1), range(-3, 4), 1.0)])
    for column in WEIGHT_COLUMNS:
        for side in (range(-5, -3), range(4, 6)):
            graph.change([block_of(column, range(-2, EAST_END + 1), side, 0.0)])
        graph.change([block_of(column, range(-2, 0), range(-5, 6), 0.0)])
    return graph


def _came_from_the_street(graph: Graph) -> None:
    """The agent is off the road; it drove there over the kerb, long ago."""
    graph.change([_path(12.0, x_m=20.0), _heading_north(20.0, 12.0)])


def _path(length_m: float, x_m: float = 0.0) -> PathSegment:
    """A path along y, from 0, long ago."""
    y_m = np.linspace(0.0, length_m, 1 + round(abs(length_m)))
    rows = np.zeros((len(y_m), len(PathColumn)))
    rows[:, PathColumn.STAMP_S] = LONG_AGO_S
    rows[:, PathColumn.X_M] = x_m
    rows[:, PathColumn.Y_M] = y_m
    return PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))


def _heading_north(x_m: float, y_m: float) -> Self:
    return agent(x_m=x_m, y_m=y_m, heading_rad=math.pi / 2, stamp_ns=round(NOW_S * 1e9))


def _plan(graph: Graph) -> Plan:
    stamp_ns = round(NOW_S * 1e9)
    task = Task(stamp_ns=stamp_ns, task_id="1/route_plan", codelet="route_plan", cycle=1, version=0)
    answer = run(task, graph, Config(explore=True))
    graph.change(answer.operations)
    plan = graph.get(Plan, PLAN_ID)
    assert plan is not None
    return plan


def test_an_agent_that_left_the_road_goes_back_to_explore() -> None:
    graph = _street()
    _came_from_the_street(graph)

    plan = _plan(graph)

    assert plan.state is PlanState.READY
    assert plan.route is not None
    route_m = plan.route.numpy()
    assert route_m[0] == pytest.approx((20.0, 12.0), abs=1.0)
    assert route_m[-1] == pytest.approx((EAST_END, 0.0), abs=3.0)


def test_it_does_not_go_back_through_what_stands_there_now() -> None:
    graph = _street()
    _came_from_the_street(graph)
    graph.change([block_of(PlaceColumn.OBSTACLE, range(15, 26), range(7, 9), 1.0)])

    assert _plan(graph).state is PlanState.NO_GOAL


def test_ground_too_near_for_the_camera_is_known_where_the_agent_starts() -> None:
    graph = Graph()
    here = _heading_north(0.0, 0.0)
    graph.change([Map(id=ROOT_MAP, cell_m=1.0), here])
    graph.change([block_of(PlaceColumn.ROAD, range(-3, 4), range(-20, -10), 1.0)])

    around = place_costs(graph, here, Config())

    i, j = np.array((0, 4)) - around.grid.origin
    assert around.is_known[i, j]


@pytest.mark.parametrize(("road_from_j", "is_known"), [(5, True), (12, False)])
def test_ground_too_near_for_the_camera_is_known_where_road_begins_behind_it(
    road_from_j: int, is_known: bool
) -> None:
    graph = Graph()
    here = _heading_north(0.0, 0.0)
    graph.change([Map(id=ROOT_MAP, cell_m=1.0), here, _path(-5.0)])
    for j in (range(-20, -10), range(road_from_j, 60)):
        graph.change([block_of(PlaceColumn.ROAD, range(-3, 4), j, 1.0)])

    around = place_costs(graph, here, Config())

    i, j = np.array((0, 4)) - around.grid.origin
    assert bool(around.is_known[i, j]) is is_known
