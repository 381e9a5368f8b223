"""Goals that serve a need: they go first, and the agent rests there until it is satisfied."""

from __future__ import annotations

import pytest

from cogmap.graph.graph import Graph
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Operation
from cogmap.schemas.nodes import (
    PLAN_ID,
    Goal,
    Need,
    Object,
    Plan,
    PlanState,
    goal_id,
    need_id,
    object_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.route_plan import run
from tests.support.world.street_loop import loop

CHARGING = goal_id("energy")


def plan(graph: Graph, config: Config | None = None) -> Plan:
    """The plan that the graph has once the codelet has run."""
    task = Task(stamp_ns=7, task_id="1/route_plan", codelet="route_plan", cycle=1, version=0)
    graph.change(run(task, graph, config or Config()).operations)
    found = graph.get(Plan, PLAN_ID)
    assert found is not None
    return found


def town(level: float, charging_x_m: float, *others: Operation) -> Graph:
    """A loop of streets with a charging place beside one, which the agent seeks at some need."""
    return loop(
        Need(id=need_id("energy"), label="energy", level=level, activation=level),
        Object(
            id=object_id("charging-place"),
            label="charging-place",
            function="charge",
            x_m=charging_x_m,
            y_m=-1.0,
        ),
        Goal(id=CHARGING, base_level=1.0, object="charging-place", need="energy"),
        *others,
    )


def test_a_goal_that_serves_a_need_goes_before_a_nearer_one() -> None:
    near = Goal(id=goal_id("near"), base_level=1.0, x_m=10.0, y_m=0.0)

    assert plan(town(0.7, 40.0, near)).goals == [CHARGING]


@pytest.mark.parametrize("level", [0.7, 0.11])
def test_at_the_place_the_agent_rests_until_the_need_is_satisfied(level: float) -> None:
    graph = town(level, 3.0)

    assert plan(graph).state is PlanState.RESTS
    assert graph.get(Goal, CHARGING) is not None


def test_once_satisfied_the_goal_is_forgotten() -> None:
    graph = town(0.1, 3.0)
    plan(graph)

    assert graph.get(Goal, CHARGING) is None


def test_other_goals_are_next_once_the_need_is_satisfied() -> None:
    far = Goal(id=goal_id("far"), base_level=1.0, x_m=40.0, y_m=0.0)
    graph = town(0.05, 3.0, far)

    after = plan(graph)

    assert after.state is PlanState.READY
    assert after.goals == [far.id]


def test_of_several_places_that_satisfy_a_need_it_goes_to_the_one_with_the_shortest_route() -> None:
    across = Object(
        id=object_id("41a"),
        label="charging-place",
        function="charge",
        x_m=3.0,
        y_m=20.0,
    )
    graph = town(0.7, 40.0, across)
    found = plan(graph)

    assert found.goals == [CHARGING]
    assert found.route is not None
    assert found.route.numpy()[-1].tolist() == [3.0, 20.0]
