"""Driving by keys."""

from __future__ import annotations

import pytest

from cogmap.cli.teleop import HELD_NS, LOOK_NS, Steering
from cogmap.robot import TRACK_M, WHEEL_RADIUS_M
from cogmap.runtime.module import Module
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand


def pressed(*keys: str, after_ns: int = 0) -> MotorCommand:
    """The command at a clock so long after the last of the keys."""
    steering = Steering(speed_m_s=2.0, turn_rate_rad_s=0.5)
    module = steering.module()
    now_ns = 10**12
    for key in keys:
        steering.press(key)
        tick(module, now_ns)
    for _ in range(after_ns // LOOK_NS):
        now_ns += LOOK_NS
        tick(module, now_ns)
    (command,) = module.feed(Clock(stamp_ns=7))
    assert isinstance(command, MotorCommand)
    return command


def tick(module: Module, now_ns: int) -> None:
    assert module.timers[0].handler(now_ns) is None


@pytest.mark.parametrize("key", ["i", "\x1b[A"])
def test_a_held_key_drives_ahead(key: str) -> None:
    command = pressed(key, after_ns=HELD_NS - LOOK_NS)

    assert command.stamp_ns == 7
    assert command.left_wheel_rad_s == pytest.approx(2.0 / WHEEL_RADIUS_M)
    assert command.right_wheel_rad_s == command.left_wheel_rad_s


@pytest.mark.parametrize(
    ("key", "ahead", "left"), [("u", 1, 1), ("j", 0, 1), ("l", 0, -1), (",", -1, 0), (".", -1, 1)]
)
def test_a_key_leads_where_it_lies(key: str, ahead: int, left: int) -> None:
    command = pressed("i", key)

    turn_rad_s = command.right_wheel_rad_s - command.left_wheel_rad_s
    speed_rad_s = (command.right_wheel_rad_s + command.left_wheel_rad_s) / 2
    assert turn_rad_s * WHEEL_RADIUS_M / TRACK_M == pytest.approx(0.5 * left)
    assert speed_rad_s * WHEEL_RADIUS_M == pytest.approx(2.0 * ahead)


@pytest.mark.parametrize(("keys", "after_ns"), [(["i", "k"], 0), (["i"], HELD_NS), ([], 0)])
def test_the_robot_stands_without_a_key(keys: list[str], after_ns: int) -> None:
    command = pressed(*keys, after_ns=after_ns)

    assert (command.left_wheel_rad_s, command.right_wheel_rad_s) == (0.0, 0.0)


def test_a_key_that_leads_nowhere_is_ignored() -> None:
    assert pressed("i", "x") == pressed("i")
