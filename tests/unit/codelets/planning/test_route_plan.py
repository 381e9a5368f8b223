"""Plans: routes to goals over the map, their order, and what is replayed; exploration."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.runtime.codelet import Answer, CycleContext
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Direction, RouteReplay
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import (
    NEVER_NS,
    CostLayer,
    Goal,
    LinkKind,
    Object,
    PlaceColumn,
    PlanState,
    goal_id,
    object_id,
    place_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.route_plan import due
from cogmap.testing import agent, percepts
from tests.support.world.route_planning import STAMP_NS, answered, goal_at, planned
from tests.support.world.street_loop import barrier, block_of, cells_of, loop


def _routes(answer: Answer) -> list[RouteReplay]:
    """The routes that an answer replays."""
    return [event for event in answer.events if isinstance(event, RouteReplay)]


def test_a_goal_is_linked_to_the_place_from_which_it_is_reached() -> None:
    bakery = Object(id=object_id("bakery"), label="bakery", x_m=30.0, y_m=-12.0)
    graph = loop(bakery, Goal(id=goal_id("bakery"), object="bakery"))
    plan = planned(graph)

    assert plan.route is not None
    i, j = np.rint(plan.route.numpy()[-1]).astype(int).tolist()
    assert graph.links.target(goal_id("bakery"), LinkKind.AT) == place_id(i, j)


def test_a_route_leads_along_the_streets_to_the_goal() -> None:
    plan = planned(loop(goal_at("corner", 57.0, 40.0)))

    assert plan.state is PlanState.READY
    assert plan.route is not None
    route_m = plan.route.numpy()
    assert route_m[0] == pytest.approx((3.0, 0.0))
    assert route_m[-1] == pytest.approx((57.0, 40.0))
    assert np.hypot(*np.diff(route_m, axis=0).T).max() <= math.sqrt(2) + 1e-9


def test_where_a_street_is_closed_the_plan_takes_the_other() -> None:
    graph = loop(goal_at("far", 40.0, 0.0))
    before = planned(graph)
    graph.change([barrier(20, 0)])
    after = planned(graph)

    assert before.detour_for == {}
    assert after.length_m > before.length_m + 60.0
    assert max(after.detour_for, key=after.detour_for.__getitem__) is CostLayer.OBSTACLE
    assert after.route is not None
    assert after.route.numpy()[:, 1].max() > 35.0


def test_goals_are_visited_from_near_to_far() -> None:
    plan = planned(loop(goal_at("a", 57.0, 40.0), goal_at("b", 30.0, 0.0), goal_at("c", 3.0, 20.0)))

    assert plan.goals == [goal_id("c"), goal_id("b"), goal_id("a")]


@pytest.mark.parametrize(
    ("goal", "state"),
    [
        (goal_at("x", 900.0, 0.0), PlanState.OUTSIDE),
        (goal_at("x", 30.0, 20.0), PlanState.BLOCKED),
        (Goal(id=goal_id("x"), object="harbour"), PlanState.UNKNOWN_GOAL),
    ],
    ids=["outside", "blocked", "unknown"],
)
def test_a_goal_without_a_route_is_in_the_plan_with_the_reason(
    goal: Goal, state: PlanState
) -> None:
    plan = planned(loop(goal, goal_at("near", 20.0, 0.0)))

    assert plan.unreachable == {goal.id: state}
    assert plan.goals == [goal_id("near")]


def test_an_object_is_reached_from_the_street_beside_it() -> None:
    bakery = Object(id=object_id("bakery"), label="bakery", x_m=30.0, y_m=-12.0)
    plan = planned(loop(bakery, Goal(id=goal_id("bakery"), object="bakery")))

    assert plan.route is not None
    assert plan.route.numpy()[-1] == pytest.approx((30.0, -2.0), abs=1.0)


def test_a_goal_where_the_agent_is_counts_as_reached_and_is_replayed_backwards() -> None:
    graph = loop(goal_at("b", 30.0, 0.0))
    plan = planned(graph)
    graph.change([agent(x_m=29.0)])
    answer = answered(graph)

    goal = graph.get(Goal, goal_id("b"))
    assert goal is not None
    assert goal.reached_ns == STAMP_NS
    replay = answer.events[0]
    assert isinstance(replay, RouteReplay)
    assert replay.direction is Direction.REVERSE
    assert plan.route is not None
    assert replay.cells.numpy()[-1] == pytest.approx(plan.route.numpy()[0])


def test_a_goal_where_the_agent_starts_leaves_a_plan_that_states_so() -> None:
    plan = planned(loop(goal_at("here", 3.0, 0.0)))

    assert plan.state is PlanState.AT_GOAL
    assert plan.route is None


def test_a_goal_that_was_not_the_next_one_is_not_replayed() -> None:
    graph = loop(goal_at("b", 30.0, 0.0))
    answered(graph)
    graph.change([goal_at("a", 10.0, 0.0), agent(x_m=10.0)])

    assert all(event.goal != goal_id("b") for event in _routes(answered(graph)))


def test_where_all_goals_are_reached_nothing_is_planned() -> None:
    graph = loop(goal_at("here", 3.0, 0.0))
    context = CycleContext(cycle=5, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    assert due(context, graph, Config())

    answered(graph)
    assert due(context, graph, Config()) == []


def test_a_new_goal_is_replayed_forward_once() -> None:
    graph = loop(goal_at("b", 30.0, 0.0))
    first = answered(graph)
    second = answered(graph)

    directions = [event.direction for event in first.events if isinstance(event, RouteReplay)]
    assert directions == [Direction.FORWARD]
    assert second.events == []


def test_at_the_end_of_its_route_an_agent_follows_an_object_that_has_moved_on_the_map() -> None:
    bakery = Object(id=object_id("bakery"), label="bakery", x_m=30.0, y_m=-12.0)
    graph = loop(bakery, Goal(id=goal_id("bakery"), object="bakery"))
    plan = planned(graph)
    assert plan.route is not None
    end_x_m, end_y_m = plan.route.numpy()[-1].tolist()

    # It came to the end, and the object has meanwhile moved by a little more than counts as there.
    moved = msgspec.structs.replace(bakery, x_m=bakery.x_m + 3.0)
    graph.change([moved, agent(x_m=end_x_m, y_m=end_y_m)])
    after = planned(graph)

    assert after.route is not None
    assert after.route.numpy()[-1] == pytest.approx((end_x_m + 3.0, end_y_m))


def test_a_plan_that_serves_is_not_written_again() -> None:
    graph = loop(goal_at("b", 40.0, 0.0))
    answered(graph)
    graph.change([agent(x_m=12.0, y_m=0.5)])

    assert answered(graph).operations == []


@pytest.mark.parametrize("explores", [False, True])
def test_where_every_goal_is_reached_the_plan_states_so_and_has_no_route(explores: bool) -> None:
    goal = msgspec.structs.replace(goal_at("b", 40.0, 0.0), reached_ns=1)
    plan = planned(loop(goal), Config(explore=explores))

    assert plan.state is PlanState.AT_GOAL
    assert plan.route is None


def _in_order(*goals: Goal) -> list[Goal]:
    """The goals, each after the one before."""
    chained = [goals[0]]
    for goal in goals[1:]:
        chained.append(msgspec.structs.replace(goal, after=chained[-1].id))

    return chained


def test_a_goal_after_another_is_planned_once_that_is_reached() -> None:
    there = goal_at("there", 40.0, 0.0)
    back = goal_at("back", 20.0, 0.0)
    graph = loop(*_in_order(there, back))

    assert planned(graph).goals == [there.id]

    graph.change([agent(x_m=40.0)])
    assert planned(graph).goals == [back.id]


def test_a_goal_that_is_passed_before_its_turn_is_not_reached() -> None:
    there = goal_at("there", 40.0, 0.0)
    start = goal_at("start", 3.0, 0.0)
    graph = loop(*_in_order(there, start))
    answered(graph)

    passed = graph.get(Goal, start.id)
    assert passed is not None
    assert passed.reached_ns == NEVER_NS


def test_a_goal_after_one_that_there_is_none_of_counts_at_once() -> None:
    goal = msgspec.structs.replace(goal_at("b", 40.0, 0.0), after=goal_id("harbour"))

    assert planned(loop(goal)).goals == [goal.id]


def test_an_agent_that_has_reached_its_goals_does_not_explore() -> None:
    graph = loop(goal_at("here", 3.0, 0.0))
    context = CycleContext(cycle=5, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    config = Config(explore=True)

    assert planned(graph, config).state is PlanState.AT_GOAL
    assert due(context, graph, config) == []


@pytest.mark.parametrize(("barrier_i", "is_due"), [(20, True), (50, False)])
def test_a_route_that_is_blocked_is_planned_anew_at_once(barrier_i: int, is_due: bool) -> None:
    between_plans = CycleContext(cycle=6, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    graph = loop(goal_at("b", 54.0, 0.0))
    answered(graph)
    assert due(between_plans, graph, Config()) == []

    graph.change([barrier(barrier_i, 0)])

    assert bool(due(between_plans, graph, Config())) is is_due


def test_without_a_goal_the_agent_explores_where_the_road_is_open() -> None:
    i, j = np.mgrid[54:61, 10:44]
    unknown = cells_of(PlaceColumn.ROAD, np.column_stack([i.ravel(), j.ravel()]), 0.0)
    plan = planned(loop(unknown), Config(explore=True))

    assert plan.explores
    assert plan.route is not None
    end_x_m, end_y_m = plan.route.numpy()[-1].tolist()
    assert 50.0 <= end_x_m <= 60.0
    assert 8.0 <= end_y_m <= 40.0


def test_where_all_is_known_there_is_nothing_to_explore() -> None:
    plan = planned(loop(), Config(explore=True))

    assert plan.state is PlanState.NO_GOAL
    assert not plan.explores


def test_a_goal_that_is_forgotten_is_no_longer_in_the_plan() -> None:
    graph = loop(goal_at("b", 40.0, 0.0))
    answered(graph)
    graph.change([DropNode(id=goal_id("b"))])
    plan = planned(graph)

    assert plan.goals == []
    assert plan.planned_ns > NEVER_NS


def test_a_gap_narrower_than_the_robot_is_no_way() -> None:
    gap = block_of(PlaceColumn.OBSTACLE, range(20, 21), range(1, 2), 0.0)
    plan = planned(loop(goal_at("far", 40.0, 0.0), barrier(20, 0), gap))

    assert plan.route is not None
    assert plan.route.numpy()[:, 1].max() > 35.0


def test_a_gap_as_wide_as_the_robot_is_passed() -> None:
    gap = block_of(PlaceColumn.OBSTACLE, range(20, 21), range(0, 2), 0.0)
    plan = planned(loop(goal_at("far", 40.0, 0.0), barrier(20, 0), gap))

    assert plan.route is not None
    assert plan.route.numpy()[:, 1].max() <= 3.0


GRADIENT = Config(planning="gradient")


def test_on_a_flat_grid_a_route_goes_from_place_to_place() -> None:
    plan = planned(loop(goal_at("corner", 57.0, 40.0)), GRADIENT)

    assert plan.route is not None
    steps = np.abs(np.diff(plan.route.numpy(), axis=0))
    assert (steps.max(axis=1) == 1.0).all()
    assert plan.route.numpy()[-1] == pytest.approx((57.0, 40.0))


def test_on_a_flat_grid_the_nearest_goal_is_always_next() -> None:
    """The agent is at (3, 0): north is 12 m away, east 10 m, and so the tour begins north, the
    flat one east (figure 5 C).
    """
    goals = [goal_at("north", 3.0, 12.0), goal_at("east", 13.0, 0.0), goal_at("far", 25.0, 0.0)]

    flat = [goal_id("east"), goal_id("far"), goal_id("north")]
    assert planned(loop(*goals), GRADIENT).goals == flat
    short = [goal_id("north"), goal_id("east"), goal_id("far")]
    assert planned(loop(*goals)).goals == short
