"""What survival is measured by, and the agent that acts at random beside."""

from __future__ import annotations

from collections import Counter

from benchmarks.cognition.life import Life
from benchmarks.cognition.random_actions import RandomActions
from cogmap.schemas.cognition import ActionName, Behaviour, Behaviours, Rejection

SEEK = Behaviour(
    scheme="satisfy_need", activation=1.0, action=ActionName.SEEK, parameters={"need": "energy"}
)
FOLLOW = Behaviour(
    scheme="follow_route",
    activation=0.0,
    action=ActionName.FOLLOW_PLAN,
    rejection=Rejection.CONTEXT_MISSING,
)


def acted(seed: int, broadcasts: int = 400) -> list[str]:
    """What an agent does at random, that is able to seek and not to follow a plan."""
    acting = RandomActions(seed)
    actions = []
    for cycle in range(broadcasts):
        behaviours = Behaviours(cycle=cycle, behaviours=[SEEK, FOLLOW])
        actions.append(acting.on_behaviours(behaviours).action)

    return actions


def test_a_life_at_level_0_ran_out() -> None:
    assert Life(lived_s=240.0, lowest=0.0, charged=2).ran_out
    assert not Life(lived_s=900.0, lowest=0.1, charged=2).ran_out


def test_at_random_every_action_that_can_be_taken_is() -> None:
    counts = Counter(acted(1))

    assert set(counts) == {ActionName.HALT, ActionName.TURN, ActionName.SEEK}
    assert counts[ActionName.TURN] > counts[ActionName.SEEK] > 50


def test_the_same_seed_acts_the_same() -> None:
    assert acted(1) == acted(1)
    assert acted(1) != acted(2)
