"""What a robot is asked for."""

from __future__ import annotations

import pytest

from cogmap.errors import MessageError
from cogmap.robot import TRACK_M, WHEEL_RADIUS_M
from cogmap.ros2.steering import MAX_AGE_NS, Limits, Speeds, Steering
from cogmap.schemas.sensing import MotorCommand

S = 10**9
LIMITS = Limits(speed_m_s=0.5, turn_rate_rad_s=1.0, hold_s=1.0)


def command(speed_m_s: float, turn_rate_rad_s: float = 0.0, stamp_ns: int = S) -> MotorCommand:
    """A command for our own robot, by its wheels."""
    apart_m_s = turn_rate_rad_s * TRACK_M / 2
    return MotorCommand(
        stamp_ns=stamp_ns,
        left_wheel_rad_s=(speed_m_s - apart_m_s) / WHEEL_RADIUS_M,
        right_wheel_rad_s=(speed_m_s + apart_m_s) / WHEEL_RADIUS_M,
    )


@pytest.mark.parametrize(
    ("asked", "passed_on"),
    [
        ((0.4, 0.2), (0.4, 0.2)),
        ((-0.4, -0.2), (-0.4, -0.2)),
        ((1.0, 0.2), (0.5, 0.1)),
        ((0.4, 4.0), (0.1, 1.0)),
        ((0.0, 0.0), (0.0, 0.0)),
    ],
)
def test_speeds_stay_within_the_limits_along_the_same_arc(
    asked: tuple[float, float], passed_on: tuple[float, float]
) -> None:
    steering = Steering(LIMITS)
    steering.on_command(command(*asked), S, S)

    assert steering.speeds == pytest.approx(Speeds(*passed_on))


def test_nothing_is_asked_before_the_first_command() -> None:
    steering = Steering(LIMITS)
    steering.on_timer(9 * S)

    assert steering.speeds is None


def test_a_command_that_none_follows_ends_in_a_stop() -> None:
    steering = Steering(LIMITS)
    steering.on_command(command(0.4), S, 10 * S)

    steering.on_timer(11 * S)
    assert steering.speeds == pytest.approx(Speeds(0.4))
    steering.on_timer(11 * S + 1)
    assert steering.speeds == Speeds()
    steering.on_timer(12 * S)
    assert steering.stops == 1


def test_a_command_for_what_was_seen_long_ago_is_refused() -> None:
    steering = Steering(LIMITS)

    with pytest.raises(MessageError, match=r"seen 2\.6 s ago"):
        steering.on_command(command(0.4), S + MAX_AGE_NS + S // 10, S)
    assert steering.speeds is None


def test_a_command_that_a_newer_one_overtook_is_ignored() -> None:
    steering = Steering(LIMITS)
    steering.on_command(command(0.4, stamp_ns=2 * S), 2 * S, S)
    steering.on_command(command(0.1, stamp_ns=S), 2 * S, S)

    assert steering.speeds == pytest.approx(Speeds(0.4))
