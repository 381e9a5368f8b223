"""The goal of an agent that seeks what satisfies a need. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from cogmap.errors import MessageError
from cogmap.schemas.base import Scalar
from cogmap.schemas.cognition import ActionName, MotorProgram
from cogmap.schemas.nodes import Goal, goal_id


def sought_by(program: MotorProgram) -> Goal | None:
    """The goal that a motor program gives the agent; None where it is not one that seeks.

    Raises MessageError where it lacks a parameter.
    """
    if program.action != ActionName.SEEK:
        return None

    need = _word(program.parameters, "need")
    return Goal(
        id=goal_id(need),
        base_level=1.0,
        object=_word(program.parameters, "object"),
        need=need,
    )


def _word(parameters: Mapping[str, Scalar], name: str) -> str:
    value = parameters.get(name)
    if not isinstance(value, str) or not value:
        raise MessageError(f"motor program: parameter {name!r} is {value!r}, not a word")
    return value
