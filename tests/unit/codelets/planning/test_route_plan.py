"""Plans: routes to goals over the map, their order, and what is replayed; exploration."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, CycleContext
from schemas.array import Array, Matrix
from schemas.codelets import Task
from schemas.cognition import Direction, RouteReplay
from schemas.graph import DropNode
from schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    Goal,
    LinkKind,
    Object,
    PathColumn,
    PathSegment,
    PlaceColumn,
    Plan,
    PlanState,
    goal_id,
    object_id,
    place_id,
    segment_id,
)
from services.codelets.planning.config import Config
from services.codelets.planning.route_plan import due, run
from tests.support.world.scenes import agent, percepts
from tests.support.world.street_loop import barrier, cells_of, loop

STAMP_NS = 7_000_000_000


def _goal(name: str, x_m: float, y_m: float) -> Goal:
    return Goal(id=goal_id(name), base_level=1.0, x_m=x_m, y_m=y_m)


def _answer(graph: Graph, config: Config | None = None) -> Answer:
    """What the codelet answers now; it is applied to the graph."""
    task = Task(stamp_ns=STAMP_NS, task_id="1/route_plan", codelet="route_plan", cycle=1, version=0)
    answer = run(task, graph, config or Config())
    graph.change(answer.operations)
    return answer


def _plan(graph: Graph, config: Config | None = None) -> Plan:
    """The plan that the graph has then."""
    _answer(graph, config)
    plan = graph.get(Plan, PLAN_ID)
    assert plan is not None
    return plan


def _routes(answer: Answer) -> list[RouteReplay]:
    """The routes that an answer replays."""
    return [event for event in answer.events if isinstance(event, RouteReplay)]


def test_a_goal_is_linked_to_the_place_from_which_it_is_reached() -> None:
    bakery = Object(id=object_id("bakery"), label="bakery", x_m=30.0, y_m=-12.0)
    graph = loop(bakery, Goal(id=goal_id("bakery"), object="bakery"))
    plan = _plan(graph)

    assert plan.route is not None
    i, j = np.rint(plan.route.numpy()[-1]).astype(int).tolist()
    assert graph.links.target(goal_id("bakery"), LinkKind.AT) == place_id(i, j)


def test_a_route_leads_along_the_streets_to_the_goal() -> None:
    plan = _plan(loop(_goal("corner", 57.0, 40.0)))

    assert plan.state is PlanState.READY
    assert plan.route is not None
    route_m = plan.route.numpy()
    assert route_m[0] == pytest.approx((3.0, 0.0))
    assert route_m[-1] == pytest.approx((57.0, 40.0))
    assert np.hypot(*np.diff(route_m, axis=0).T).max() <= math.sqrt(2) + 1e-9


def test_where_a_street_is_closed_the_plan_takes_the_other() -> None:
    graph = loop(_goal("far", 40.0, 0.0))
    before = _plan(graph)
    graph.change([barrier(20, 0)])
    after = _plan(graph)

    assert after.length_m > before.length_m + 60.0
    assert after.route is not None
    assert after.route.numpy()[:, 1].max() > 35.0


def test_goals_are_visited_from_near_to_far() -> None:
    plan = _plan(loop(_goal("a", 57.0, 40.0), _goal("b", 30.0, 0.0), _goal("c", 3.0, 20.0)))

    assert plan.goals == [goal_id("c"), goal_id("b"), goal_id("a")]


@pytest.mark.parametrize(
    ("goal", "state"),
    [
        (_goal("x", 900.0, 0.0), PlanState.OUTSIDE),
        (_goal("x", 30.0, 20.0), PlanState.BLOCKED),
        (Goal(id=goal_id("x"), object="harbour"), PlanState.UNKNOWN_GOAL),
    ],
    ids=["outside", "blocked", "unknown"],
)
def test_a_goal_without_a_route_is_in_the_plan_with_the_reason(
    goal: Goal, state: PlanState
) -> None:
    plan = _plan(loop(goal, _goal("near", 20.0, 0.0)))

    assert plan.unreachable == {goal.id: state}
    assert plan.goals == [goal_id("near")]


def test_a_goal_behind_closed_streets_has_no_route() -> None:
    goal = msgspec.structs.replace(_goal("far", 40.0, 40.0), doubts=Config().max_doubts)
    graph = loop(goal, barrier(20, 0), barrier(20, 40))
    plan = _plan(graph)

    assert plan.state is PlanState.NO_ROUTE
    assert plan.unreachable == {goal_id("far"): PlanState.NO_ROUTE}


def test_the_last_street_that_may_be_open_again_is_tried_to_its_end() -> None:
    goal = msgspec.structs.replace(_goal("far", 40.0, 0.0), doubts=Config().max_doubts - 1)
    graph = loop(goal, barrier(20, 0), barrier(20, 40))
    assert _plan(graph).doubtful

    graph.change([agent(x_m=6.0)])
    assert _plan(graph).doubtful


@pytest.mark.parametrize(("later_s", "state"), [(60, PlanState.NO_ROUTE), (900, PlanState.READY)])
def test_a_goal_without_a_route_is_tried_again_after_a_while(
    later_s: int, state: PlanState
) -> None:
    goal = msgspec.structs.replace(_goal("far", 40.0, 0.0), doubts=Config().max_doubts)
    graph = loop(goal, barrier(20, 0), barrier(20, 40))
    assert _plan(graph).state is PlanState.NO_ROUTE

    later_ns = STAMP_NS + later_s * 1_000_000_000
    later = Task(
        stamp_ns=later_ns, task_id="9/route_plan", codelet="route_plan", cycle=9, version=0
    )
    graph.change(run(later, graph, Config()).operations)

    plan = graph.get(Plan, PLAN_ID)
    assert plan is not None
    assert plan.state is state


def test_where_all_is_closed_a_street_out_of_sight_may_be_open_again() -> None:
    graph = loop(_goal("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    plan = _plan(graph)
    goal = graph.get(Goal, goal_id("far"))

    assert plan.doubtful
    assert plan.route is not None
    assert np.abs(plan.route.numpy()[:, 1]).max() <= 3.0
    assert goal is not None
    assert goal.doubts == 1


def test_a_street_that_is_seen_to_be_closed_is_not_in_doubt() -> None:
    graph = loop(_goal("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    graph.change([agent(x_m=16.0)])
    plan = _plan(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert plan.route.numpy()[:, 1].max() > 35.0


TRIES = Config(reopened_share=0.9, doubt_weight=0.2, blocked_from_m=10.0)


@pytest.mark.parametrize(
    ("config", "is_tried"),
    [
        (TRIES, True),
        (msgspec.structs.replace(TRIES, reopened_share=0.1), False),
        (msgspec.structs.replace(TRIES, blocked_from_m=30.0), False),
    ],
    ids=["likely", "unlikely", "in sight"],
)
def test_a_street_that_is_likely_open_again_is_tried_where_the_way_round_is_long(
    config: Config, is_tried: bool
) -> None:
    graph = loop(_goal("far", 40.0, 0.0), barrier(20, 0))
    plan = _plan(graph, config)

    assert plan.doubtful is is_tried
    assert plan.route is not None
    assert bool(plan.route.numpy()[:, 1].max() < 5.0) is is_tried


def test_a_street_that_is_tried_is_tried_until_the_agent_is_near() -> None:
    graph = loop(_goal("far", 40.0, 0.0), barrier(20, 0))
    assert _plan(graph, TRIES).doubtful
    graph.change([agent(x_m=12.0)])
    assert _plan(graph, TRIES).doubtful

    graph.change([agent(x_m=16.0)])
    assert not _plan(graph, TRIES).doubtful


def test_where_the_way_round_is_short_no_street_is_tried() -> None:
    graph = loop(_goal("corner", 40.0, 40.0), barrier(20, 0))

    assert not _plan(graph, TRIES).doubtful


def _was_at(stamp_s: float, *x_m: float) -> PathSegment:
    """A path along x."""
    rows = np.zeros((len(x_m), len(PathColumn)))
    rows[:, PathColumn.STAMP_S] = stamp_s
    rows[:, PathColumn.X_M] = x_m
    return PathSegment(id=segment_id(0), number=0, rows=Matrix.of(rows))


@pytest.mark.parametrize(("ago_s", "is_north"), [(60.0, True), (900.0, False)])
def test_a_street_that_was_seen_to_be_closed_is_not_in_doubt_for_a_while(
    ago_s: float, is_north: bool
) -> None:
    graph = loop(_goal("far", 40.0, 0.0), barrier(20, 0), barrier(20, 40))
    graph.change([agent(x_m=3.0, stamp_ns=1_000_000_000_000), _was_at(1000.0 - ago_s, 16.0)])
    plan = _plan(graph)

    assert plan.doubtful
    assert plan.route is not None
    assert (plan.route.numpy()[:, 1].max() > 35.0) == is_north


@pytest.mark.parametrize(("ago_s", "state"), [(20.0, PlanState.READY), (200.0, PlanState.NO_ROUTE)])
def test_between_walls_that_it_sees_the_agent_goes_back_by_the_way_it_has_come(
    ago_s: float, state: PlanState
) -> None:
    graph = loop(_goal("far", 3.0, 40.0), barrier(12, 0), barrier(20, 0))
    here = agent(x_m=16.0, stamp_ns=1_000_000_000_000)
    graph.change([here, _was_at(1000.0 - ago_s, *range(3, 17))])
    plan = _plan(graph)

    assert plan.state is state


def test_an_object_is_reached_from_the_street_beside_it() -> None:
    bakery = Object(id=object_id("bakery"), label="bakery", x_m=30.0, y_m=-12.0)
    plan = _plan(loop(bakery, Goal(id=goal_id("bakery"), object="bakery")))

    assert plan.route is not None
    assert plan.route.numpy()[-1] == pytest.approx((30.0, -2.0), abs=1.0)


def test_a_goal_where_the_agent_is_counts_as_reached_and_is_replayed_backwards() -> None:
    graph = loop(_goal("b", 30.0, 0.0))
    plan = _plan(graph)
    graph.change([agent(x_m=29.0)])
    answer = _answer(graph)

    goal = graph.get(Goal, goal_id("b"))
    assert goal is not None
    assert goal.reached_ns == STAMP_NS
    replay = answer.events[0]
    assert isinstance(replay, RouteReplay)
    assert replay.direction is Direction.REVERSE
    assert plan.route is not None
    assert replay.cells.numpy()[-1] == pytest.approx(plan.route.numpy()[0])


def test_a_goal_where_the_agent_starts_leaves_a_plan_that_states_so() -> None:
    plan = _plan(loop(_goal("here", 3.0, 0.0)))

    assert plan.state is PlanState.AT_GOAL
    assert plan.route is None


def test_a_goal_that_was_not_the_next_one_is_not_replayed() -> None:
    graph = loop(_goal("b", 30.0, 0.0))
    _answer(graph)
    graph.change([_goal("a", 10.0, 0.0), agent(x_m=10.0)])

    assert all(event.goal != goal_id("b") for event in _routes(_answer(graph)))


def test_where_all_goals_are_reached_nothing_is_planned() -> None:
    graph = loop(_goal("here", 3.0, 0.0))
    context = CycleContext(cycle=5, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    assert due(context, graph, Config())

    _answer(graph)
    assert due(context, graph, Config()) == []


def test_a_new_goal_is_replayed_forward_once() -> None:
    graph = loop(_goal("b", 30.0, 0.0))
    first = _answer(graph)
    second = _answer(graph)

    directions = [event.direction for event in first.events if isinstance(event, RouteReplay)]
    assert directions == [Direction.FORWARD]
    assert second.events == []


def test_a_plan_that_serves_is_not_written_again() -> None:
    graph = loop(_goal("b", 40.0, 0.0))
    _answer(graph)
    graph.change([agent(x_m=12.0, y_m=0.5)])

    assert _answer(graph).operations == []


@pytest.mark.parametrize("explores", [False, True])
def test_where_every_goal_is_reached_the_plan_states_so_and_has_no_route(explores: bool) -> None:
    goal = msgspec.structs.replace(_goal("b", 40.0, 0.0), reached_ns=1)
    plan = _plan(loop(goal), Config(explore=explores))

    assert plan.state is PlanState.AT_GOAL
    assert plan.route is None


def _in_order(*goals: Goal) -> list[Goal]:
    """The goals, each after the one before."""
    chained = [goals[0]]
    for goal in goals[1:]:
        chained.append(msgspec.structs.replace(goal, after=chained[-1].id))

    return chained


def test_a_goal_after_another_is_planned_once_that_is_reached() -> None:
    there = _goal("there", 40.0, 0.0)
    back = _goal("back", 20.0, 0.0)
    graph = loop(*_in_order(there, back))

    assert _plan(graph).goals == [there.id]

    graph.change([agent(x_m=40.0)])
    assert _plan(graph).goals == [back.id]


def test_a_goal_that_is_passed_before_its_turn_is_not_reached() -> None:
    there = _goal("there", 40.0, 0.0)
    start = _goal("start", 3.0, 0.0)
    graph = loop(*_in_order(there, start))
    _answer(graph)

    passed = graph.get(Goal, start.id)
    assert passed is not None
    assert passed.reached_ns == NEVER_NS


def test_a_goal_after_one_that_there_is_none_of_counts_at_once() -> None:
    goal = msgspec.structs.replace(_goal("b", 40.0, 0.0), after=goal_id("harbour"))

    assert _plan(loop(goal)).goals == [goal.id]


def test_an_agent_that_has_reached_its_goals_does_not_explore() -> None:
    graph = loop(_goal("here", 3.0, 0.0))
    context = CycleContext(cycle=5, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    config = Config(explore=True)

    assert _plan(graph, config).state is PlanState.AT_GOAL
    assert due(context, graph, config) == []


@pytest.mark.parametrize(("barrier_i", "is_due"), [(20, True), (50, False)])
def test_a_route_that_is_blocked_is_planned_anew_at_once(barrier_i: int, is_due: bool) -> None:
    between_plans = CycleContext(cycle=6, percepts=percepts(4), motions=Array.of(np.zeros((0, 5))))
    graph = loop(_goal("b", 54.0, 0.0))
    _answer(graph)
    assert due(between_plans, graph, Config()) == []

    graph.change([barrier(barrier_i, 0)])

    assert bool(due(between_plans, graph, Config())) is is_due


def test_without_a_goal_the_agent_explores_where_the_road_is_open() -> None:
    i, j = np.mgrid[54:61, 10:44]
    unknown = cells_of(PlaceColumn.ROAD, np.column_stack([i.ravel(), j.ravel()]), 0.0)
    plan = _plan(loop(unknown), Config(explore=True))

    assert plan.explores
    assert plan.route is not None
    end_x_m, end_y_m = plan.route.numpy()[-1].tolist()
    assert 50.0 <= end_x_m <= 60.0
    assert 8.0 <= end_y_m <= 40.0


def test_where_all_is_known_there_is_nothing_to_explore() -> None:
    plan = _plan(loop(), Config(explore=True))

    assert plan.state is PlanState.NO_GOAL
    assert not plan.explores


def test_a_goal_that_is_forgotten_is_no_longer_in_the_plan() -> None:
    graph = loop(_goal("b", 40.0, 0.0))
    _answer(graph)
    graph.change([DropNode(id=goal_id("b"))])
    plan = _plan(graph)

    assert plan.goals == []
    assert plan.planned_ns > NEVER_NS
