"""A robot on a slow machine: its poses are old, on the in-memory bus."""

from __future__ import annotations

import math
from collections import deque

import pytest

from cogmap.robot import TRACK_M, WHEEL_RADIUS_M
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from cogmap.services.motor.module import Config, build
from cogmap.testing import agent
from tests.support.world.motor import action_of
from tests.support.world.plans import joined, plan_along

TICK_S = 0.05
CYCLE_TICKS = 8
PLAN = plan_along((0.0, 0.0), (25.0, 0.0), (25.0, 25.0))
STREET_HALF_WIDTH_M = 4.0


class SlowMachine:
    """A robot whose pose at a frame reaches motor `age_s` later, every CYCLE_TICKS.

    The wheels obey the newest command without delay; there is no noise.
    """

    def __init__(self, age_s: float) -> None:
        self.module = Module("body", emits={topics.CLOCK, topics.DELTA, topics.ACTION})
        self.module.on(topics.MOTOR_COMMAND, self.on_command)
        self.commands: list[MotorCommand] = []
        self.farthest_m = 0.0
        self._delay_ticks = round(age_s / TICK_S)
        self._ticks = 0
        self._pose = (0.0, 0.0, 0.0)
        self._wheels_m_s = (0.0, 0.0)
        self._pending: deque[tuple[int, Delta]] = deque()

    def on_command(self, command: MotorCommand) -> None:
        """Obey the newest command."""
        radius_m = WHEEL_RADIUS_M
        self.commands.append(command)
        self._wheels_m_s = (
            command.left_wheel_rad_s * radius_m,
            command.right_wheel_rad_s * radius_m,
        )

    def tick(self) -> list[Message]:
        """Move for a tick: the clock, and the pose that has been computed by now."""
        self._move()
        self._ticks += 1
        if self._ticks % CYCLE_TICKS == 0:
            due = self._ticks + self._delay_ticks
            self._pending.append((due, self._delta()))

        messages: list[Message] = [Clock(stamp_ns=self._now_ns(), rate=1.0)]
        while self._pending and self._pending[0][0] <= self._ticks:
            messages.append(self._pending.popleft()[1])

        return messages

    def _move(self) -> None:
        x_m, y_m, heading_rad = self._pose
        left, right = self._wheels_m_s
        step_m = (left + right) / 2 * TICK_S
        turn_rad = (right - left) / TRACK_M * TICK_S
        middle_rad = heading_rad + turn_rad / 2
        x_m += step_m * math.cos(middle_rad)
        y_m += step_m * math.sin(middle_rad)
        self._pose = (x_m, y_m, heading_rad + turn_rad)
        self.farthest_m = max(self.farthest_m, _off_street_m(x_m, y_m))

    def _delta(self) -> Delta:
        x_m, y_m, heading_rad = self._pose
        cycle = self._ticks // CYCLE_TICKS

        return Delta(
            stamp_ns=self._now_ns(),
            version=cycle,
            cycle=cycle,
            phase=Phase.LOCALIZATION,
            operations=[agent(x_m=x_m, y_m=y_m, heading_rad=heading_rad)],
        )

    def _now_ns(self) -> int:
        return round(self._ticks * TICK_S * 1e9)


def _off_street_m(x_m: float, y_m: float) -> float:
    """The distance from the nearer of the two streets that PLAN leads along."""
    along_x_m = min(max(x_m, 0.0), 25.0)
    along_y_m = min(max(y_m, 0.0), 25.0)
    to_first_m = math.hypot(x_m - along_x_m, y_m)
    to_second_m = math.hypot(x_m - 25.0, y_m - along_y_m)
    return min(to_first_m, to_second_m)


def _drive(age_s: float, seconds: float, config: Config) -> SlowMachine:
    machine = SlowMachine(age_s)
    motor = joined(build(config, "motor"), PLAN)
    with InProcessRunner([machine.module, motor]) as runner:
        body = runner.shells[0]
        body.publish(machine.module.stamp(action_of()))
        for _ in range(round(seconds / TICK_S)):
            body.publish(machine.module.stamp(machine.tick()))
            runner.run()

    return machine


def test_with_poses_over_a_second_old_the_robot_keeps_to_its_street() -> None:
    machine = _drive(1.5, 60.0, Config())
    slowed_by = {command.slowed_by for command in machine.commands}
    oldest_ns = max(command.pose_age_ns for command in machine.commands)

    assert machine.farthest_m < STREET_HALF_WIDTH_M / 2
    assert SpeedLimit.POSE_AGE in slowed_by
    assert oldest_ns == pytest.approx(1.5e9)


def test_at_full_speed_it_would_leave_the_street() -> None:
    reckless = Config(blind_m=1000.0, lateral_m_s2=100.0)

    assert _drive(1.5, 20.0, reckless).farthest_m > STREET_HALF_WIDTH_M


def test_with_fresh_poses_it_reaches_the_corner_at_full_speed() -> None:
    machine = _drive(0.1, 12.0, Config())
    slowed_by = {command.slowed_by for command in machine.commands}

    assert machine.farthest_m < STREET_HALF_WIDTH_M / 2
    assert slowed_by
    assert SpeedLimit.POSE_AGE not in slowed_by


def test_poses_older_than_the_limit_move_no_wheel() -> None:
    machine = _drive(2.2, 10.0, Config())
    halted_by = {command.halted_by for command in machine.commands}

    assert halted_by == {SpeedLimit.POSE_AGE}
