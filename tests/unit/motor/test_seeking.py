"""An agent that seeks what satisfies a need has the goal to be there."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.schemas.nodes import Goal, goal_id
from cogmap.services.motor.programs import sought_by


def program(action: str, **parameters: Scalar) -> MotorProgram:
    """A program of an action."""
    return MotorProgram(cycle=1, action=action, parameters=parameters)


def test_to_seek_is_to_have_the_goal_of_the_object_for_the_need() -> None:
    goal = sought_by(program(ActionName.SEEK, need="energy", object="41a"))

    assert goal == Goal(id=goal_id("energy"), base_level=1.0, object="41a", need="energy")


def test_other_actions_have_no_goal() -> None:
    assert sought_by(program(ActionName.FOLLOW_PLAN)) is None


@pytest.mark.parametrize("parameters", [{}, {"need": "energy"}, {"need": "energy", "object": 3}])
def test_what_is_sought_must_be_named(parameters: dict[str, Scalar]) -> None:
    with pytest.raises(MessageError, match=r"is .*, not a word"):
        sought_by(program(ActionName.SEEK, **parameters))
