"""The simulation as a module, in lockstep and in real time."""

from __future__ import annotations

from typing import TypeVar

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.errors import ConfigError, MessageError
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import (
    MotorCommand,
    Odometry,
    Percepts,
    SelfMotion,
    SpeedLimit,
    StereoFrame,
    TruePose,
    TrueTown,
)
from cogmap.services.sim.module import Config, build
from cogmap.testing import of_type

M = TypeVar("M", bound=Message)
TICK_NS = 50_000_000
SMALL = {"width_px": 64, "height_px": 64}
START_NS = 10**12


def _command(stamp_ns: int, left_rad_s: float = 15.0, right_rad_s: float = 15.0) -> MotorCommand:
    return MotorCommand(
        stamp_ns=stamp_ns, left_wheel_rad_s=left_rad_s, right_wheel_rad_s=right_rad_s
    )


def _start(module: Module) -> list[Message]:
    assert module.start is not None
    return module.stamp(module.start())


def _lockstep(frames: int) -> list[Message]:
    module = build(Config(**SMALL), run=LOCKSTEP)
    messages = _start(module)
    for number in range(frames):
        messages += module.feed(_command(messages[-1].stamp_ns, 15.0, 15.0 + number))

    return messages


def _tick(module: Module, at_ns: int) -> list[Message]:
    """What the timer of the simulation publishes at a time."""
    return module.stamp(module.timers[0].handler(at_ns))


def _real_time(
    module: Module, ticks: int, first_tick: int = 0, answer: bool = True
) -> list[Message]:
    messages: list[Message] = []
    for number in range(first_tick, first_tick + ticks):
        new = _tick(module, START_NS + number * TICK_NS)
        messages += new
        if answer and new and isinstance(new[-1], StereoFrame):
            module.feed(_command(new[-1].stamp_ns))

    return messages


def _check_that_frames_follow_their_odometry(messages: list[Message]) -> None:
    last_ns = 0
    for message in messages:
        if isinstance(message, Odometry):
            assert message.stamp_ns == last_ns + TICK_NS
            last_ns = message.stamp_ns
        elif isinstance(message, StereoFrame):
            assert message.stamp_ns == last_ns


def test_two_lockstep_runs_of_one_seed_give_the_same_bytes() -> None:
    assert [encode(message) for message in _lockstep(5)] == [
        encode(message) for message in _lockstep(5)
    ]


def test_lockstep_moves_by_one_frame_for_each_answer_to_the_last_one() -> None:
    messages = _lockstep(4)

    assert isinstance(messages[0], TrueTown)
    assert [frame.frame for frame in of_type(StereoFrame, messages)] == [0, 1, 2, 3, 4]
    assert {clock.rate for clock in of_type(Clock, messages)} == {0.0}

    _check_that_frames_follow_their_odometry(messages)


def _speeds_m_s(messages: list[Message]) -> list[float]:
    return [abs(odometry.speed_m_s) for odometry in of_type(Odometry, messages)]


def _stamps_ns(kind: type[Message], messages: list[Message]) -> list[int]:
    return [message.stamp_ns for message in of_type(kind, messages)]


def test_lockstep_ignores_commands_that_answer_another_frame() -> None:
    module = build(Config(**SMALL), run=LOCKSTEP)
    stamp_ns = _start(module)[-1].stamp_ns

    other = _command(stamp_ns + 1)
    asked = _command(stamp_ns)

    assert module.feed(other) == []
    assert module.feed(asked)
    assert module.feed(asked) == []


def test_real_time_publishes_nothing_before_it_is_started() -> None:
    module = build(Config(**SMALL))

    assert _real_time(module, 3) == []

    _start(module)

    assert _real_time(module, 1)


def test_real_time_begins_with_the_first_frame() -> None:
    module = build(Config(**SMALL))
    _start(module)

    messages = _real_time(module, 1)

    (frame,) = of_type(StereoFrame, messages)
    assert frame.frame == 0
    assert frame.stamp_ns == 4 * TICK_NS
    _check_that_frames_follow_their_odometry(messages)


def test_real_time_keeps_its_rates_and_frames_follow_their_odometry() -> None:
    module = build(Config(**SMALL))
    _start(module)
    messages = _real_time(module, 120)
    counts = {
        kind.__name__: len(of_type(kind, messages))
        for kind in (Clock, Odometry, TruePose, StereoFrame, TrueTown)
    }

    assert counts == {
        "Clock": 120,
        "Odometry": 123,
        "TruePose": 120,
        "StereoFrame": 30,
        "TrueTown": 2,
    }
    assert of_type(Clock, messages)[-1].rate == pytest.approx(1.0)

    _check_that_frames_follow_their_odometry(messages)
    poses = of_type(TruePose, messages)

    assert 12.0 < poses[-1].travelled_m < 18.0
    assert poses[-1].progress == pytest.approx(poses[-1].stamp_ns / 900e9)


def test_a_town_is_sensed_by_percepts_in_real_time_too() -> None:
    module = build(Config(sensing="percepts"))
    _start(module)
    messages = _real_time(module, 21, answer=False)

    assert len(of_type(SelfMotion, messages)) == len(of_type(Percepts, messages)) == 6


def test_real_time_falls_behind_rather_than_catch_up_over_0_25_s() -> None:
    module = build(Config(**SMALL))
    _start(module)
    _real_time(module, 1)

    late = _tick(module, START_NS + 60 * TICK_NS)
    clocks = of_type(Clock, late)

    assert len(of_type(Odometry, late)) == 5
    assert len(of_type(StereoFrame, late)) == 1
    assert clocks[-1].rate < 0.2


def test_a_robot_that_receives_no_command_for_a_second_brakes() -> None:
    module = build(Config(**SMALL))
    _start(module)

    moving = _real_time(module, 60)
    standing = _real_time(module, 60, first_tick=60, answer=False)
    speeds = _speeds_m_s(moving + standing)

    assert np.mean(speeds[50:60]) > 2.0
    assert np.mean(speeds[-10:]) < 0.05


def test_an_older_command_that_arrives_late_is_ignored() -> None:
    module = build(Config(**SMALL))
    _start(module)
    messages = _real_time(module, 20)
    old_ns = messages[-1].stamp_ns - 4 * TICK_NS

    module.feed(_command(old_ns, -15.0, -15.0))

    after = _real_time(module, 10, first_tick=20, answer=False)
    last = of_type(Odometry, after)[-1]
    assert last.speed_m_s > 1.0


def test_a_command_older_than_the_limit_is_refused_and_moves_no_wheel() -> None:
    module = build(Config(**SMALL))
    _start(module)
    messages = _real_time(module, 55, answer=False)
    old_ns = messages[-1].stamp_ns - 52 * TICK_NS

    with pytest.raises(MessageError, match=r"it is 2\.6 s old, .* none older than 2\.5 s"):
        module.feed(_command(old_ns))

    still = _real_time(module, 10, first_tick=55, answer=False)
    assert _speeds_m_s(still)[-1] < 0.05


def test_the_wheels_stop_when_their_command_becomes_too_old() -> None:
    module = build(Config(**SMALL))
    _start(module)

    messages = _real_time(module, 60)
    command = _command(of_type(StereoFrame, messages)[-1].stamp_ns)
    for tick in range(60, 140, 10):
        if tick < 110:
            module.feed(command)
        messages += _real_time(module, 10, first_tick=tick, answer=False)
    speeds = _speeds_m_s(messages)

    assert np.mean(speeds[100:106]) > 2.0
    assert np.mean(speeds[-10:]) < 0.05


def _wait_for_command(module: Module, seconds: int) -> list[list[Message]]:
    """What the timer of a simulation in lockstep publishes, second by second."""
    return [_tick(module, second * 10**9) for second in range(seconds)]


def test_in_lockstep_a_frame_that_nobody_answers_is_published_again() -> None:
    module = build(Config(**SMALL), run=LOCKSTEP)
    first = _start(module)
    messages = _wait_for_command(module, 23)
    repeated = [second for second, published in enumerate(messages) if published]
    assert repeated == [10, 20]

    again = messages[10]
    assert _stamps_ns(Odometry, again) == _stamps_ns(Odometry, first)
    assert _stamps_ns(StereoFrame, again) == _stamps_ns(StereoFrame, first)

    frame = of_type(StereoFrame, first)[0]
    assert of_type(StereoFrame, again)[0].left == frame.left


def test_in_lockstep_a_frame_published_again_is_answered_only_once() -> None:
    module = build(Config(**SMALL), run=LOCKSTEP)
    asked = _command(_start(module)[-1].stamp_ns)
    _wait_for_command(module, 11)

    messages = module.feed(asked)
    (frame,) = of_type(StereoFrame, messages)

    assert frame.frame == 1
    assert module.feed(asked) == []
    assert _tick(module, 12 * 10**9) == []


def test_a_frame_rate_that_does_not_divide_that_of_the_odometry_is_refused() -> None:
    with pytest.raises(ConfigError, match="choose one that divides"):
        build(Config(frame_hz=6))


@pytest.mark.parametrize("run", [REAL_TIME, LOCKSTEP])
def test_a_restarted_world_continues_where_it_was_with_the_robot_at_rest(
    run: Run,
) -> None:
    config = Config(egl=False, **SMALL)
    before = build(config, run=run)
    messages = _start(before)
    if run.lockstep:
        messages += before.feed(_command(messages[-1].stamp_ns))
    else:
        messages += _real_time(before, 90)
    poses = of_type(TruePose, messages)
    last_frame = of_type(StereoFrame, messages)[-1]

    after = build(config, run=run)
    assert after.restore is not None
    after.restore(poses)
    again = _start(after)
    if not run.lockstep:
        again += _real_time(after, 4)
    odometry = of_type(Odometry, again)[0]
    frame = of_type(StereoFrame, again)[0]
    start = of_type(TruePose, again)[0]

    assert odometry.stamp_ns == poses[-1].stamp_ns + TICK_NS
    assert frame.frame == last_frame.frame + 1
    assert start.pose.x_m == pytest.approx(poses[-1].pose.x_m, abs=0.1)
    assert start.travelled_m == pytest.approx(poses[-1].travelled_m, abs=0.1)
    assert start.progress == pytest.approx(poses[-1].progress, abs=0.005)


def _at_goal(stamp_ns: int) -> MotorCommand:
    return msgspec.structs.replace(_command(stamp_ns, 0.0, 0.0), halted_by=SpeedLimit.AT_GOAL)


SENSING = [{"sensing": "cameras"}, {"sensing": "percepts", "town": "blocks", "town_size_m": 120.0}]


@pytest.mark.parametrize("sensing", SENSING, ids=["cameras", "percepts"])
def test_a_drive_that_ends_at_its_goal_is_over_once_the_robot_halts_there(
    sensing: dict[str, str | float],
) -> None:
    settings = {"ends_at_goal": True, **SMALL, **sensing}
    module = build(msgspec.convert(settings, Config), run=LOCKSTEP)
    messages = _start(module)
    assert of_type(TruePose, messages)[-1].progress < 1.0

    last = module.feed(_at_goal(messages[-1].stamp_ns))
    assert of_type(TruePose, last)[-1].progress == 1.0
    assert module.feed(_command(last[-1].stamp_ns)) == []


def test_a_drive_that_does_not_end_at_its_goal_goes_on_there() -> None:
    module = build(Config(**SMALL), run=LOCKSTEP)
    messages = _start(module)
    after = module.feed(_at_goal(messages[-1].stamp_ns))

    assert of_type(TruePose, after)[-1].progress < 1.0
    assert module.feed(_command(after[-1].stamp_ns))


def test_a_restarted_simulation_of_a_drive_that_was_over_stays_over() -> None:
    config = Config(ends_at_goal=True, egl=False, **SMALL)
    before = build(config, run=LOCKSTEP)
    messages = _start(before)
    messages += before.feed(_at_goal(messages[-1].stamp_ns))

    after = build(config, run=LOCKSTEP)
    assert after.restore is not None
    after.restore(of_type(TruePose, messages))
    again = _start(after)

    assert of_type(TruePose, again)[-1].progress == 1.0
