"""Wheel odometry with noise and drift."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest

from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout import town
from cogmap.services.sim.odometry import Noise, WheelOdometry

DT_S = 0.05
WITHOUT_NOISE = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.0)
PACE_M = 0.2
STEPS_OF_A_CORNER = 20


def _moved(speed: float, turn_rate: float) -> Pose:
    middle = turn_rate * DT_S / 2
    return Pose(
        x_m=speed * DT_S * math.cos(middle),
        y_m=speed * DT_S * math.sin(middle),
        heading_rad=turn_rate * DT_S,
    )


ORIGIN = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)


def test_noise_multiplies_speed_and_turn_rate_by_something_of_mean_one() -> None:
    noise = Noise(speed=0.1, turn=0.2, drift_rad_per_sqrt_m=0.0)
    wheels = WheelOdometry(noise, seed=3)
    after = _moved(4.0, 0.5)
    rows = [wheels.measure(ORIGIN, after, DT_S) for _ in range(4000)]

    speeds = np.array([row.speed_m_s for row in rows])
    assert speeds.mean() == pytest.approx(4.0, rel=0.01)
    assert speeds.std() == pytest.approx(0.4, rel=0.1)

    turns = np.array([row.turn_rate_rad_s for row in rows])
    assert turns.mean() == pytest.approx(0.5, rel=0.02)
    assert turns.std() == pytest.approx(0.1, rel=0.1)


def test_a_robot_that_stands_still_reports_no_motion() -> None:
    wheels = WheelOdometry(Noise(), seed=1)
    row = wheels.measure(ORIGIN, ORIGIN, DT_S)

    assert row.speed_m_s == 0.0
    assert row.turn_rate_rad_s == 0.0


def _drift_rad(wheels: WheelOdometry, distance_m: float, steps: int) -> float:
    """How far the heading by the wheels drifts over a distance straight ahead."""
    after = _moved(distance_m / DT_S / steps, 0.0)
    turned_rad = 0.0
    for _ in range(steps):
        row = wheels.measure(ORIGIN, after, DT_S)
        turned_rad += row.turn_rate_rad_s * DT_S

    return turned_rad


@pytest.mark.parametrize("steps", [1, 10])
def test_drift_grows_with_the_square_root_of_the_distance_whatever_the_steps(steps: int) -> None:
    noise = Noise(speed=0.0, turn=0.0, drift_rad_per_sqrt_m=0.02)
    wheels = WheelOdometry(noise, seed=5)
    distance_m = 4.0 * DT_S
    drifts_rad = [_drift_rad(wheels, distance_m, steps) for _ in range(2000)]

    assert np.std(drifts_rad) == pytest.approx(0.02 * math.sqrt(distance_m), rel=0.1)


def test_driving_backwards_is_reported_as_a_negative_speed() -> None:
    wheels = WheelOdometry(WITHOUT_NOISE, seed=0)
    row = wheels.measure(ORIGIN, _moved(-1.5, 0.0), DT_S)

    assert row.speed_m_s == pytest.approx(-1.5)


def test_path_integration_alone_ends_a_lap_some_metres_off() -> None:
    errors = [_error_after_a_lap(seed) for seed in range(30)]

    assert 3.0 < np.mean(errors) < 12.0


def _lap(seed: int) -> list[Pose]:
    """The true poses of a lap of a town, a pace apart, its corners rounded on the spot."""
    turns_rad: list[float] = []
    quarter_rad = math.pi / 2
    for a, b in itertools.pairwise(town.generate(seed).line()):
        turns_rad += [0.0] * round(math.dist(a, b) / PACE_M)
        turns_rad += [quarter_rad / STEPS_OF_A_CORNER] * STEPS_OF_A_CORNER

    here = 0j
    heading = 0.0
    poses = [ORIGIN]
    for turn_rad in turns_rad:
        here += cmath.rect(PACE_M, heading + turn_rad / 2)
        heading += turn_rad
        poses.append(Pose(x_m=here.real, y_m=here.imag, heading_rad=heading))

    return poses


def _error_after_a_lap(seed: int) -> float:
    wheels = WheelOdometry(Noise(), seed)
    lap = _lap(seed % 5)
    guess = 0j
    guessed_heading = 0.0
    for before, after in itertools.pairwise(lap):
        row = wheels.measure(before, after, DT_S)
        turned_rad = row.turn_rate_rad_s * DT_S
        guess += cmath.rect(row.speed_m_s * DT_S, guessed_heading + turned_rad / 2)
        guessed_heading += turned_rad

    return abs(guess - complex(lap[-1].x_m, lap[-1].y_m))
