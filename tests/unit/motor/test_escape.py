"""A robot that is stuck, or stands before an obstacle, backs away for a while."""

from __future__ import annotations

from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from cogmap.services.motor.motor import halted
from cogmap.services.motor.reactive.escape import BACK_S, HALTED_S, Escape


def _forward(seconds: float) -> MotorCommand:
    return MotorCommand(
        stamp_ns=round(seconds * 1e9),
        left_wheel_rad_s=5.0,
        right_wheel_rad_s=5.0,
    )


def _before_obstacle(seconds: float) -> MotorCommand:
    return halted(round(seconds * 1e9), SpeedLimit.OBSTACLE)


def _backs(command: MotorCommand) -> bool:
    return command.left_wheel_rad_s < 0 and command.right_wheel_rad_s < 0


def test_a_robot_that_moves_is_left_alone() -> None:
    escape = Escape()

    assert escape.command(_forward(1.0), is_stuck=False) == _forward(1.0)


def test_a_stuck_robot_backs_away_for_a_while() -> None:
    escape = Escape()
    first = escape.command(_forward(1.0), is_stuck=True)
    last = escape.command(_forward(1.0 + 0.9 * BACK_S), is_stuck=False)
    after = escape.command(_forward(1.0 + BACK_S), is_stuck=False)

    assert first.slowed_by is SpeedLimit.STUCK
    assert [_backs(command) for command in (first, last, after)] == [True, True, False]


def test_before_an_obstacle_it_waits_before_it_backs_away() -> None:
    escape = Escape()
    first = escape.command(_before_obstacle(1.0), is_stuck=False)
    later = escape.command(_before_obstacle(1.0 + HALTED_S), is_stuck=False)

    assert first.halted_by is SpeedLimit.OBSTACLE
    assert _backs(later)
    assert not later.halted_by


def test_an_obstacle_that_goes_away_is_forgotten() -> None:
    escape = Escape()
    escape.command(_before_obstacle(1.0), is_stuck=False)
    escape.command(_forward(1.2), is_stuck=False)

    assert not _backs(escape.command(_before_obstacle(1.0 + HALTED_S), is_stuck=False))
