"""Streets that were closed and may be open again: which are tried, and for how long."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.schemas.array import Matrix
from cogmap.schemas.nodes import (
    PathColumn,
    PathSegment,
    PlaceColumn,
    PlanState,
    segment_id,
)
from cogmap.testing import agent
from tests.support.world.route_planning import goal_at, planned
from tests.support.world.street_loop import barrier, block_of, loop


def test_where_all_is_closed_a_street_out_of_sight_may_be_open_again() -> None:
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    plan = planned(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert np.abs(plan.route.numpy()[:, 1]).max() <= 3.0


def test_a_street_that_is_seen_to_be_closed_is_not_in_doubt() -> None:
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    graph.change([agent(x_m=16.0)])
    plan = planned(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert plan.route.numpy()[:, 1].max() > 35.0


@pytest.mark.parametrize(("ago_s", "state"), [(60, PlanState.NO_ROUTE), (900, PlanState.READY)])
def test_streets_that_were_seen_to_be_closed_from_near_are_tried_again_after_a_while(
    ago_s: float, state: PlanState
) -> None:
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    beside = _was_at(1000.0 - ago_s, (16.0, 0.0), (16.0, 40.0))
    graph.change([agent(x_m=3.0, stamp_ns=1_000_000_000_000), beside])

    assert planned(graph).state is state


def _was_at(stamp_s: float, *at_m: tuple[float, float]) -> PathSegment:
    """A path that heads along x."""
    rows = np.zeros((len(at_m), len(PathColumn)))
    rows[:, PathColumn.STAMP_S] = stamp_s
    rows[:, PathColumn.LAST_S] = stamp_s
    rows[:, [PathColumn.X_M, PathColumn.Y_M]] = at_m
    return PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))


@pytest.mark.parametrize(("ago_s", "is_north"), [(60.0, True), (900.0, False)])
def test_a_street_that_was_seen_to_be_closed_is_not_in_doubt_for_a_while(
    ago_s: float, is_north: bool
) -> None:
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    graph.change([agent(x_m=3.0, stamp_ns=1_000_000_000_000), _was_at(1000.0 - ago_s, (16.0, 0.0))])
    plan = planned(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert (plan.route.numpy()[:, 1].max() > 35.0) == is_north


@pytest.mark.parametrize(("ago_s", "is_north"), [(60.0, True), (900.0, False)])
def test_a_street_that_was_seen_to_be_closed_from_afar_is_tried_later(
    ago_s: float, is_north: bool
) -> None:
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    graph.change([agent(x_m=3.0, stamp_ns=1_000_000_000_000), _was_at(1000.0 - ago_s, (5.0, 0.0))])
    plan = planned(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert (plan.route.numpy()[:, 1].max() > 35.0) == is_north


def test_a_street_that_was_seen_to_be_closed_from_afar_is_tried_in_the_end() -> None:
    wall = block_of(PlaceColumn.ROAD, range(19, 22), range(36, 45), 0.0)
    graph = loop(goal_at("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40), wall)
    graph.change([agent(x_m=3.0, stamp_ns=1_000_000_000_000), _was_at(940.0, (5.0, 0.0))])
    plan = planned(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert plan.route.numpy()[:, 1].max() <= 3.0


@pytest.mark.parametrize(("ago_s", "state"), [(20.0, PlanState.READY), (200.0, PlanState.NO_ROUTE)])
def test_between_walls_that_it_sees_the_agent_goes_back_by_the_way_it_has_come(
    ago_s: float, state: PlanState
) -> None:
    graph = loop(goal_at("far", 3.0, 40.0), barrier(12, 0), barrier(20, 0))
    here = agent(x_m=16.0, stamp_ns=1_000_000_000_000)
    graph.change([here, _was_at(1000.0 - ago_s, *((x_m, 0.0) for x_m in range(3, 17)))])
    plan = planned(graph)

    assert plan.state is state
