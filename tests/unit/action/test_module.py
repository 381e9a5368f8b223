"""Action as a module: what broadcasts, poses, scans and clocks make of the wheels."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from schemas.array import Array
from schemas.base import Message
from schemas.cognition import (
    Action,
    Broadcast,
    Coalition,
    Competition,
    Trigger,
)
from schemas.graph import Delta, Phase
from schemas.nodes import Node
from schemas.process import Clock
from schemas.sensing import MotorCommand, RangeScan, SelfMotion, SpeedLimit
from services.action.module import Config, build
from services.action.selection import FOLLOW_ROUTE, HALT
from tests.support.messages import of_type
from tests.support.world.scenes import agent

PERIOD_NS = 200_000_000
Legs = tuple[tuple[float, float], ...]


def _scan(*obstacles: tuple[float, float], cycle: int = 1) -> RangeScan:
    bearing_rad, range_m = np.array(obstacles, np.float32).reshape(-1, 2).T
    return RangeScan(
        stamp_ns=cycle * PERIOD_NS,
        frame=cycle,
        bearing_rad=Array.of(bearing_rad),
        range_m=Array.of(range_m),
    )


def _module(mode: str = "real_time", route: Legs = ((20.0, 0.0),)) -> Module:
    config = Config(mode=mode, route=[*route])  # type: ignore[arg-type]
    return build(config, "action")


def _delta(cycle: int = 1, x_m: float = 0.0, phase: Phase = Phase.LOCALIZATION) -> Delta:
    me = agent(x_m=x_m, stamp_ns=cycle * PERIOD_NS)
    return Delta(
        stamp_ns=cycle * PERIOD_NS,
        version=cycle,
        cycle=cycle,
        phase=phase,
        tasks=[],
        operations=[me],
    )


def _broadcast(cycle: int = 1) -> Broadcast:
    knowing = Node(id="self", kind="self", activation=1.0)
    coalition = Coalition(codelet="whereabouts", activation=0.5, nodes=[knowing])
    return Broadcast(stamp_ns=cycle * PERIOD_NS, cycle=cycle, trigger="t", coalition=coalition)


def _competition(cycle: int = 1, trigger: Trigger = Trigger.NONE) -> Competition:
    return Competition(stamp_ns=cycle * PERIOD_NS, cycle=cycle, contenders=[], trigger=trigger)


def _motion(cycle: int = 1, speed_m_s: float = 2.0) -> SelfMotion:
    rows = np.array([[speed_m_s, 0.0, PERIOD_NS / 1e9, 0.0, 0.0]])
    return SelfMotion(
        stamp_ns=cycle * PERIOD_NS,
        frame=cycle,
        since_ns=(cycle - 1) * PERIOD_NS,
        motions=Array.of(rows),
    )


def _driving() -> Module:
    """A module that follows its route."""
    module = _module()
    module.feed(_broadcast())
    return module


def _commands(messages: list[Message]) -> list[MotorCommand]:
    return of_type(MotorCommand, messages)


def _command(module: Module, message: Message) -> MotorCommand:
    """The only command that follows a message."""
    (command,) = _commands(module.feed(message))
    return command


def test_before_any_broadcast_the_robot_stands() -> None:
    command = _command(_module(), _delta())

    assert command.left_wheel_rad_s == 0.0
    assert command.halted_by is SpeedLimit.NO_ACTION


def test_a_broadcast_selects_an_action_and_the_next_pose_moves_the_robot() -> None:
    module = _module()
    (action,) = module.feed(_broadcast())

    assert isinstance(action, Action)
    assert (action.scheme, action.cycle) == (FOLLOW_ROUTE, 1)
    assert action.parameters == {"leg": 0, "length_m": 20.0, "turn_rad": 0.0, "travelled_m": 0.0}

    (command,) = _commands(module.feed(_delta()))

    assert command.left_wheel_rad_s > 0
    assert command.stamp_ns == PERIOD_NS


def test_at_the_end_of_the_route_a_broadcast_halts_the_robot() -> None:
    module = _module(route=((3.0, 0.0),))
    module.feed(_broadcast())
    for cycle in range(1, 20):
        module.feed(_delta(cycle, 0.5 * cycle))

    (action,) = module.feed(_broadcast(20))

    assert isinstance(action, Action)
    assert action.scheme == HALT

    (command,) = _commands(module.feed(_delta(20, 9.0)))

    assert (command.left_wheel_rad_s, command.right_wheel_rad_s, command.halted_by) == (
        0.0,
        0.0,
        "no action",
    )


def test_without_a_route_the_robot_is_halted_for_want_of_one() -> None:
    module = _module(route=())
    module.feed(_broadcast())
    command = _command(module, _delta())

    assert command.halted_by is SpeedLimit.NO_ROUTE


def test_an_obstacle_in_the_scan_halts_the_robot_until_it_has_gone() -> None:
    module = _driving()
    module.feed(_scan((0.0, 1.2), (0.05, 1.2)))
    before_it = _command(module, _delta(1))

    module.feed(_scan(cycle=2))
    afterwards = _command(module, _delta(2))

    assert before_it.halted_by is SpeedLimit.OBSTACLE
    assert afterwards.halted_by is SpeedLimit.NONE


@pytest.mark.parametrize("phase", [Phase.PERCEPTS, Phase.OBJECTS, Phase.END])
def test_deltas_without_a_new_pose_lead_to_no_command(phase: str) -> None:
    delta = _delta(phase=phase)

    assert _module().feed(delta) == []


def test_a_pose_that_is_committed_late_leads_to_a_command_too() -> None:
    late = _delta(phase=Phase.LATE)
    published = _module().feed(late)

    assert len(_commands(published)) == 1


def test_in_lockstep_the_command_waits_for_the_senses_and_the_cycle_before() -> None:
    inputs = {
        "delta": _delta(2),
        "scan": _scan(cycle=2),
        "motion": _motion(2),
        "competition": _competition(1),
    }
    for last, last_message in inputs.items():
        module = _module("lockstep")
        for name, message in inputs.items():
            if name != last:
                assert module.feed(message) == []
        assert len(_commands(module.feed(last_message))) == 1


def test_in_lockstep_the_command_waits_for_the_broadcast_that_was_triggered() -> None:
    module = _module("lockstep")
    module.feed(_motion(2))
    module.feed(_scan(cycle=2))
    module.feed(_competition(1, Trigger.NO_BROADCAST))

    assert module.feed(_delta(2)) == []

    action, command = module.feed(_broadcast(1))

    assert isinstance(action, Action)
    assert isinstance(command, MotorCommand)
    assert command.left_wheel_rad_s > 0


def test_in_lockstep_the_first_cycle_waits_for_no_competition() -> None:
    module = _module("lockstep")
    module.feed(_motion())
    module.feed(_scan())

    assert len(_commands(module.feed(_delta(1)))) == 1


def test_each_pose_leads_to_one_command() -> None:
    module = _module("lockstep")
    answers = [
        module.feed(message)
        for message in (
            _motion(),
            _scan(),
            _delta(1),
            _motion(),
            _scan(),
            _competition(1),
            _competition(1),
        )
    ]

    assert [len(_commands(answer)) for answer in answers] == [0, 0, 1, 0, 0, 0, 0]


def _answered_lockstep() -> tuple[Module, MotorCommand]:
    """A module in lockstep that has answered the pose of cycle 1, and its command."""
    module = _module("lockstep")
    for message in (_broadcast(0), _motion(), _scan()):
        module.feed(message)

    (command,) = _commands(module.feed(_delta(1)))

    return module, command


def test_in_lockstep_a_repeated_pose_is_answered_by_the_same_command() -> None:
    module, command = _answered_lockstep()

    assert command.left_wheel_rad_s > 0

    (again,) = _commands(module.feed(_delta(1)))

    assert (again.stamp_ns, again.left_wheel_rad_s) == (command.stamp_ns, command.left_wheel_rad_s)
    assert again.seq == command.seq + 1


def test_in_lockstep_a_repeated_scan_ends_the_wait_for_a_lost_competition() -> None:
    module, _ = _answered_lockstep()

    for message in (_motion(2), _scan(cycle=2), _delta(2)):
        assert module.feed(message) == []

    module.feed(_motion(2))
    (command,) = _commands(module.feed(_scan(cycle=2)))

    assert command.stamp_ns == 2 * PERIOD_NS


def test_in_lockstep_a_restarted_action_without_a_pose_halts_for_a_frame() -> None:
    module = _module("lockstep")
    module.feed(_motion(6))
    assert module.feed(_scan(cycle=6)) == []

    module.feed(_motion(6))
    command = _command(module, _scan(cycle=6))
    assert command.stamp_ns == 6 * PERIOD_NS
    assert command.halted_by is SpeedLimit.NO_POSE


def test_in_lockstep_a_restarted_action_waits_for_no_past_competition() -> None:
    module = _module("lockstep")
    assert module.restore is not None

    (action,) = _module().feed(_broadcast(4))
    module.restore([action])

    for message in (_motion(6), _scan(cycle=6)):
        assert module.feed(message) == []
    assert len(_commands(module.feed(_delta(6)))) == 1


def _clock(at_s: float) -> Clock:
    return Clock(stamp_ns=round(at_s * 1e9), rate=1.0)


def test_a_pose_that_is_old_by_the_clock_moves_the_robot_more_slowly() -> None:
    fresh = _driving()
    slow = _driving()
    slow.feed(_clock(0.2 + 1.0))
    fast_command = _command(fresh, _delta(1))
    slow_command = _command(slow, _delta(1))

    assert 0 < slow_command.left_wheel_rad_s < fast_command.left_wheel_rad_s
    assert slow_command.slowed_by is SpeedLimit.POSE_AGE
    assert slow_command.pose_age_ns == 10**9


def test_a_moving_robot_that_gets_no_new_pose_is_halted_once() -> None:
    module = _driving()
    module.feed(_delta(1))
    assert module.feed(_clock(0.2 + 1.0)) == []

    halt = _command(module, _clock(0.2 + 2.1))
    assert halt.halted_by is SpeedLimit.POSE_AGE
    assert module.feed(_clock(0.2 + 2.2)) == []


def test_a_robot_that_is_commanded_to_move_and_stands_is_stuck() -> None:
    module = _driving()
    halts = {}
    for cycle in range(1, 40):
        module.feed(_motion(cycle, speed_m_s=0.02))
        command = _command(module, _delta(cycle))
        if command.halted_by:
            halts[cycle] = command.halted_by

    stuck_cycles = Config().stuck_after_s * 1e9 / PERIOD_NS
    assert set(halts.values()) == {SpeedLimit.STUCK}
    assert min(halts) == pytest.approx(stuck_cycles + 1, abs=1)


def test_a_robot_that_moves_or_is_not_commanded_to_is_not_stuck() -> None:
    moving = _driving()
    idle = _module()
    for cycle in range(1, 40):
        moving.feed(_motion(cycle))
        idle.feed(_motion(cycle, speed_m_s=0.0))
        drive = _command(moving, _delta(cycle))
        halt = _command(idle, _delta(cycle))

        assert drive.halted_by is SpeedLimit.NONE
        assert halt.halted_by is SpeedLimit.NO_ACTION


def test_a_self_motion_of_another_shape_is_refused_by_name() -> None:
    three_columns = Array.of(np.zeros((2, 3)))
    motion = msgspec.structs.replace(_motion(), motions=three_columns)

    with pytest.raises(MessageError, match="rows of 5 columns"):
        _module().feed(motion)


def test_a_restarted_action_module_continues_along_its_route() -> None:
    legs = ((20.0, 0.0), (20.0, 0.0))
    before = _module(route=legs)
    after = _module(route=legs)
    messages = before.feed(_broadcast())
    for cycle in range(1, 13):
        messages += before.feed(_delta(cycle, 2.0 * cycle))

    messages += before.feed(_broadcast(12))

    assert before.compact is not None
    assert after.restore is not None
    assert before.compact() == msgspec.structs.replace(messages[-1], seq=0, source="")

    after.restore([message for message in messages if isinstance(message, Action)])
    (command,) = _commands(after.feed(_delta(13, 25.0)))

    assert command.left_wheel_rad_s > 0

    (action,) = after.feed(_broadcast(14))

    assert isinstance(action, Action)
    assert action.parameters == {"leg": 1, "length_m": 20.0, "turn_rad": 0.0, "travelled_m": 25.0}
