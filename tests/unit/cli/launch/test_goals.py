"""Why the agent was not at its goals."""

from __future__ import annotations

from cogmap.cli.launch.goals import unreached
from cogmap.graph.graph import Graph
from cogmap.schemas.nodes import PLAN_ID, Goal, Object, Plan, PlanState, goal_id, object_id
from cogmap.testing import graph_of

KNOWN = ("bakery", "school")


def _goal(name: str, *, after: str = "", reached_ns: int = -1) -> Goal:
    before = goal_id(after) if after else ""
    return Goal(id=goal_id(name), object=name, after=before, reached_ns=reached_ns)


def _graph(plan: Plan, *goals: Goal) -> Graph:
    """A graph with a bakery and a school."""
    objects = [Object(id=object_id(name), label=name, x_m=1.0, y_m=2.0) for name in KNOWN]
    return graph_of(*objects, *goals, plan)


def _plan(goals: list[str], **unreachable: PlanState) -> Plan:
    reasons = {goal_id(name): state for name, state in unreachable.items()}
    ids = [goal_id(name) for name in goals]
    return Plan(id=PLAN_ID, state=PlanState.READY, goals=ids, unreachable=reasons)


def test_a_goal_without_a_route_has_the_reason_of_the_plan() -> None:
    plan = _plan([], bakery=PlanState.BLOCKED, school=PlanState.OUTSIDE)
    graph = _graph(plan, _goal("bakery"), _goal("school"))

    assert unreached(graph) == {
        "bakery": "the goal or the agent is at a blocked place",
        "school": "the goal is outside every map",
    }


def test_for_a_name_that_is_not_on_the_map_the_nearest_is_suggested() -> None:
    plan = _plan([], bakry=PlanState.UNKNOWN_GOAL, zoo=PlanState.UNKNOWN_GOAL)
    graph = _graph(plan, _goal("bakry"), _goal("zoo"))

    assert unreached(graph) == {
        "bakry": "the map has no object of that name: did you mean 'bakery'?",
        "zoo": "the map has no object of that name",
    }


def test_a_goal_that_was_planned_was_not_driven_to() -> None:
    graph = _graph(_plan(["bakery"]), _goal("bakery"), _goal("school", after="bakery"))

    assert unreached(graph) == {
        "bakery": "a route leads there, which was not driven to its end",
        "school": "it comes after bakery",
    }


def test_a_goal_that_is_not_in_the_plan_was_not_planned() -> None:
    assert unreached(_graph(_plan([]), _goal("school"))) == {"school": "nothing was planned for it"}


def test_a_goal_that_was_reached_needs_no_reason() -> None:
    assert unreached(_graph(_plan(["bakery"]), _goal("bakery", reached_ns=5))) == {}
