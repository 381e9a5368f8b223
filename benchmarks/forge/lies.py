"""Makes a lie of a true message: one thing of it is changed. Pure."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from benchmarks.forge.cases import FIELDS, Kind
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal, Task
from cogmap.schemas.cognition import Action, ActionName, Behaviours, MotorProgram
from cogmap.schemas.graph import Delta, Snapshot
from cogmap.schemas.nodes.base import Node
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


LIE = Node(id="lie", kind="lie", activation=1.0, base_level=1.0)
"""What a graph has that follows a forged delta, and the workspace's has not."""


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
            # A stamp of 0 states nothing.
            changes["stamp_ns"] = max(1, true.stamp_ns - OLD_NS)
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


def in_time(true: Message, now_ns: int, task: Task | None) -> Message:
    """Return `true` as its source would publish it next: a command answers the newest view, of
    `now_ns`; a proposal the newest `task`; a delta has the next version.
    """
    match true:
        case MotorCommand():
            return replace(true, stamp_ns=now_ns)
        case Proposal() if task is not None:
            return Proposal(
                stamp_ns=task.stamp_ns,
                source=true.source,
                task_id=task.task_id,
                codelet=task.codelet,
                base_version=task.version,
            )
        case Delta():
            return replace(true, version=true.version + 1)
    return true


def _commanding(message: Message) -> Message:
    """Return a message that commands what can be told from what the agent wants, or has one node
    more or less than the workspace's graph.
    """
    turn: dict[str, Any] = {"action": ActionName.TURN.value, "parameters": {"turn_rad": TURN_RAD}}
    changes: dict[str, Any] = {}
    match message:
        case MotorCommand():
            wheels = ("left_wheel_rad_s", "right_wheel_rad_s")
            changes = dict.fromkeys(wheels, BACKWARDS_RAD_S)
        case Action() | MotorProgram():
            changes = turn
        case Behaviours():
            changes["behaviours"] = [replace(each, **turn) for each in message.behaviours]
        case Delta():
            changes["operations"] = [*message.operations, LIE]
        case Snapshot():
            changes["nodes"] = message.nodes[:-1]
        case Pause():
            changes["is_paused"] = False
    return replace(message, **changes)
