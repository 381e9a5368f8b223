from __future__ import annotations

import math

import numpy as np
import pytest

from schemas.sensing import Pose
from services.sim.layout import town
from services.sim.odometry import Noise, WheelOdometry

DT_S = 0.05


def _moved(speed: float, turn_rate: float) -> Pose:
    middle = turn_rate * DT_S / 2
    return Pose(
        x_m=speed * DT_S * math.cos(middle),
        y_m=speed * DT_S * math.sin(middle),
        heading_rad=turn_rate * DT_S,
    )


ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)


def test_noise_multiplies_speed_and_turn_rate_by_something_of_mean_one() -> None:
    wheels = WheelOdometry(Noise(speed=0.1, turn=0.2, drift_rad_per_sqrt_m=0.0), seed=3)
    after = _moved(4.0, 0.5)
    rows = [wheels.measure(ORIGIN, after, DT_S) for _ in range(4000)]
    speeds, turns = np.array([(o.speed_m_s, o.turn_rate_rad_s) for o in rows]).T

    assert speeds.mean() == pytest.approx(4.0, rel=0.01)
    assert speeds.std() == pytest.approx(0.4, rel=0.1)
    assert turns.mean() == pytest.approx(0.5, rel=0.02)
    assert turns.std() == pytest.approx(0.1, rel=0.1)


def test_a_robot_that_stands_still_reports_no_motion() -> None:
    row = WheelOdometry(Noise(), seed=1).measure(ORIGIN, ORIGIN, DT_S)

    assert (row.speed_m_s, row.turn_rate_rad_s) == (0.0, 0.0)


def test_drift_grows_with_the_square_root_of_the_way_whatever_the_steps() -> None:
    noise = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.02)
    for steps in (1, 10):
        wheels = WheelOdometry(noise, seed=5)
        after = _moved(4.0 / steps, 0.0)
        rates = [
            sum(wheels.measure(ORIGIN, after, DT_S).turn_rate_rad_s for _ in range(steps))
            for _ in range(2000)
        ]

        assert np.std(rates) * DT_S == pytest.approx(0.02 * math.sqrt(4.0 * DT_S), rel=0.1)


def test_driving_backwards_is_reported_as_a_negative_speed() -> None:
    quiet = WheelOdometry(Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0), seed=0)

    assert quiet.measure(ORIGIN, _moved(-1.5, 0.0), DT_S).speed_m_s == pytest.approx(-1.5)


def test_path_integration_alone_ends_a_lap_some_metres_off() -> None:
    errors = [_error_after_a_lap(seed) for seed in range(30)]

    assert 3.0 < np.mean(errors) < 12.0


def _error_after_a_lap(seed: int) -> float:
    place = town.generate(seed % 5)
    wheels = WheelOdometry(Noise(), seed)
    heading = 0.0
    guess = 0j
    guessed_heading = 0.0
    here = 0j
    for length_m, turn_rad in place.route():
        steps = [(0.2, 0.0)] * round(length_m / 0.2) + [(0.2, turn_rad / 20)] * (
            20 if turn_rad else 0
        )
        for forward_m, turned_rad in steps:
            before = Pose(x_m=here.real, y_m=here.imag, heading_rad=heading)
            here += forward_m * complex(
                math.cos(heading + turned_rad / 2), math.sin(heading + turned_rad / 2)
            )
            heading += turned_rad
            row = wheels.measure(
                before, Pose(x_m=here.real, y_m=here.imag, heading_rad=heading), DT_S
            )
            direction = guessed_heading + row.turn_rate_rad_s * DT_S / 2
            guess += row.speed_m_s * DT_S * complex(math.cos(direction), math.sin(direction))
            guessed_heading += row.turn_rate_rad_s * DT_S

    return abs(guess - here)
