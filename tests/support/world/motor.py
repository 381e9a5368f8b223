"""The motor module, and the messages that it is fed with."""

from __future__ import annotations

import numpy as np

from cogmap.runtime.module import Module
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, ActionName, Competition, Trigger
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.sensing import MotorCommand, RangeScan, SelfMotion
from cogmap.services.motor.module import Config, build
from cogmap.testing import agent, of_type, range_scan
from tests.support.world.plans import Point, joined, plan_along

PERIOD_NS = 200_000_000


def scan_of(*obstacles: tuple[float, float], cycle: int = 1) -> RangeScan:
    """A range scan with obstacles at these bearings and ranges."""
    return range_scan(*obstacles, frame=cycle, stamp_ns=cycle * PERIOD_NS)


def module_ahead(run: Run = REAL_TIME, length_m: float = 20.0) -> Module:
    """A module whose plan leads straight ahead."""
    module = module_without_plan(run)
    return joined(module, plan_along((0.0, 0.0), (length_m, 0.0)))


def module_without_plan(run: Run = REAL_TIME) -> Module:
    """A module whose graph has no plan."""
    return build(Config(), "motor", run)


def pose_delta(cycle: int = 1, x_m: float = 0.0, phase: Phase = Phase.LOCALIZATION) -> Delta:
    """A delta that commits a pose of the self node."""
    me = agent(x_m=x_m, stamp_ns=cycle * PERIOD_NS)
    return Delta(
        stamp_ns=cycle * PERIOD_NS,
        version=cycle,
        cycle=cycle,
        phase=phase,
        tasks=[],
        operations=[me],
    )


def action_of(cycle: int = 1, action: str = ActionName.FOLLOW_PLAN, **parameters: float) -> Action:
    """The action that was selected for the broadcast of a cycle."""
    return Action(
        stamp_ns=cycle * PERIOD_NS,
        cycle=cycle,
        scheme=f"scheme of {action}",
        action=action,
        activation=1.0,
        parameters={**parameters},
    )


def no_action_of(cycle: int = 1) -> Action:
    """That none was active enough for the broadcast of a cycle."""
    return Action(stamp_ns=cycle * PERIOD_NS, cycle=cycle, scheme="", activation=0.0, parameters={})


def competition_of(cycle: int = 1, trigger: Trigger = Trigger.NONE) -> Competition:
    """The competition of a cycle."""
    return Competition(stamp_ns=cycle * PERIOD_NS, cycle=cycle, contenders=[], trigger=trigger)


def motion_of(cycle: int = 1, speed_m_s: float = 2.0) -> SelfMotion:
    """The self-motion to the view of a cycle."""
    rows = np.array([[speed_m_s, 0.0, PERIOD_NS / 1e9, 0.0, 0.0]])
    return SelfMotion(
        stamp_ns=cycle * PERIOD_NS,
        frame=cycle,
        since_ns=(cycle - 1) * PERIOD_NS,
        motions=Array.of(rows),
    )


def driving_module() -> Module:
    """A module that follows its route."""
    module = module_ahead()
    module.feed(action_of())
    return module


def commands_in(messages: list[Message]) -> list[MotorCommand]:
    """The motor commands among messages."""
    return of_type(MotorCommand, messages)


def command_after(module: Module, message: Message) -> MotorCommand:
    """The only command that follows a message."""
    (command,) = commands_in(module.feed(message))
    return command


def plan_delta(version: int, *corners: Point) -> Delta:
    """A delta at the end of a cycle with a plan."""
    plan = plan_along(*corners, planned_ns=version)
    return Delta(version=version, cycle=version, phase=Phase.END, tasks=[], operations=[plan])
