"""Patterns of nodes: kinds, conditions, variables."""

from __future__ import annotations

import pytest

from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import PLAN_ID, Goal, Plan, PlanState
from cogmap.services.procedural.patterns import Active, Condition, Pattern
from tests.support.world.schemes import active, sign

READY = Plan(id=PLAN_ID, state=PlanState.READY, base_level=1.0)
SIGN = Pattern("sign")


def _matches(pattern: Pattern, *facts: float, **attributes: float | str) -> bool:
    return pattern.match(active(sign("a", *facts, **attributes)), {}) is not None


def test_a_pattern_matches_nodes_of_its_kind_of_which_its_conditions_hold() -> None:
    ready = Pattern("plan", (Condition("state", (PlanState.READY,)),))
    at_goal = Pattern("plan", (Condition("state", (PlanState.AT_GOAL, PlanState.BLOCKED)),))

    assert ready.match(active(sign(), READY), {}) == active(READY)[0]
    assert at_goal.match(active(READY), {}) is None
    assert ready.match(active(sign()), {}) is None


@pytest.mark.parametrize(
    ("condition", "matching", "other"),
    [
        (Condition("level", (0.5, 0.75)), 0.75, 0.6),
        (Condition("level", at_least=0.5), 0.5, 0.4),
        (Condition("level", at_most=0.5), 0.5, 0.6),
        (Condition("level", at_least=0.2, at_most=0.5), 0.3, 0.1),
        (Condition("level", at_least=0.2), 0.3, "high"),
    ],
)
def test_a_condition_is_some_values_or_a_range(
    condition: Condition, matching: float, other: float | str
) -> None:
    pattern = Pattern("sign", (condition,))

    assert _matches(pattern, level=matching)
    assert not _matches(pattern, level=other)


def test_a_node_without_the_field_does_not_match() -> None:
    assert not _matches(Pattern("sign", (Condition("colour", ("red",)),)))


def test_the_most_active_node_matches_of_equals_the_first_by_id() -> None:
    nodes = active(sign("c", 0.9), sign("b", 0.9), sign("a", 0.5))
    found = SIGN.match(nodes, {})

    assert found is not None
    assert found.node.id == "sign:b"


def test_a_pattern_with_feelings_matches_what_is_broadcast_with_one_of_them() -> None:
    pattern = Pattern("sign", feelings=(Feeling.NEED, Feeling.NOVELTY))
    needed = Active(sign("a"), 1.0, Feeling.NEED)
    dangerous = Active(sign("b"), 1.0, Feeling.DANGER)
    unconscious = Active(sign("c"), 1.0)

    assert pattern.match([dangerous, needed, unconscious], {}) == needed
    assert pattern.match([dangerous, unconscious], {}) is None


def test_a_variable_that_stands_for_a_node_matches_it_alone() -> None:
    pattern = Pattern("sign", variable="it")
    nodes = active(sign("a"), sign("b", 0.4))
    found = pattern.match(nodes, {"it": "sign:b"})

    assert found is not None
    assert found.node.id == "sign:b"
    assert pattern.match(nodes, {"it": "sign:c"}) is None


def test_a_pattern_is_spelled_by_its_conditions_and_the_node_it_stands_for() -> None:
    conditions = (
        Condition("state", (PlanState.AT_GOAL, PlanState.NO_ROUTE)),
        Condition("length_m", at_least=0.5, at_most=2.0),
    )
    pattern = Pattern("plan", conditions, "it")

    assert pattern.spelled({}) == "plan state=at_goal|no_route length_m>=0.5<=2"
    assert pattern.spelled({"it": "plan"}).startswith("plan id=plan state=")


def test_the_fields_of_a_known_kind_are_those_of_its_struct() -> None:
    goal = Goal(id="goal:home", object="bakery", base_level=1.0)
    bakery = Pattern("goal", (Condition("object", ("bakery",)),))

    assert bakery.match(active(goal), {}) is not None
