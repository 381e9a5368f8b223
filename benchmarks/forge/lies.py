"""Makes a lie of a true message: one thing of it is changed. Pure."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from benchmarks.forge.cases import FIELDS, Kind
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, ActionName, Behaviours, MotorProgram
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import MotorCommand

STRANGER = "stranger"
FAR_NS = 2**60
OLD_NS = 60_000_000_000
FAR = {Kind.FAR_CYCLE: 2**60, Kind.FAR_VERSION: 2**50}
FAR_NUMBER = 2**61

BACKWARDS_RAD_S = -15.0
"""3 m/s backwards, which no module of ours commands."""

TURN_RAD = 2.71828
"""A turn that no module of ours commands to the last digit."""


def lie(kind: Kind, true: Message, number: int, told: int) -> Message:
    """Return the lie number `told` about `true`, which is the source's newest; `number` is the one
    that the source would give its next message. What the robot may obey also commands what the
    agent would not.
    """
    changes: dict[str, Any] = {"seq": number + told}
    match kind:
        case Kind.FAR_STAMP:
            changes["stamp_ns"] = FAR_NS
        case Kind.OLD_STAMP:
            changes["stamp_ns"] = max(0, true.stamp_ns - OLD_NS)
        case Kind.NEGATIVE_STAMP:
            changes["stamp_ns"] = -OLD_NS
        case Kind.FAR_CYCLE | Kind.FAR_VERSION:
            for field in set(FIELDS[kind]) & set(true.__struct_fields__):
                changes[field] = FAR[kind]
        case Kind.FAR_NUMBER:
            changes["seq"] = FAR_NUMBER + told
        case Kind.NEW_INCARNATION:
            changes["seq"] = told
        case _:
            changes |= {"seq": told, "source": STRANGER}

    return replace(_commanding(true), **changes)


def _commanding(message: Message) -> Message:
    """Return a message that commands what can be told from what the agent wants."""
    turn = {"action": ActionName.TURN.value, "parameters": {"turn_rad": TURN_RAD}}
    match message:
        case MotorCommand():
            return replace(
                message, left_wheel_rad_s=BACKWARDS_RAD_S, right_wheel_rad_s=BACKWARDS_RAD_S
            )
        case Action() | MotorProgram():
            return replace(message, **turn)
        case Behaviours():
            turning = [replace(each, **turn) for each in message.behaviours]
            return replace(message, behaviours=turning)
        case Pause():
            return replace(message, is_paused=False)
    return message
