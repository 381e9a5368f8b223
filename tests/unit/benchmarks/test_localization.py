"""Localization and mapping on a drive that is made up, by the benchmark's own means."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.localization.delay import Delay
from benchmarks.localization.measure import follow
from benchmarks.localization.senses import moments
from benchmarks.map_correction.measure import trajectory_error_m
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats

LANDMARKS = {6: (0.0, 4.0), 7: (5.0, 5.0), 8: (6.0, -1.0), 9: (-2.0, -2.0), 10: (2.0, 1.5)}
RATE_HZ = 10
LASTS_S = 200.0
SEES_M = 6.0


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Round a circle of 3 m with wheels that slip by 5 % and drift, and an eye that is 3 % and 1°
    off.
    """
    rng = np.random.default_rng(8)
    stamps = np.arange(0.0, LASTS_S, 1 / RATE_HZ)
    heading = 0.1 * stamps
    truth = np.column_stack([stamps, 3 * np.sin(heading), 3 - 3 * np.cos(heading), heading])
    felt = np.column_stack([stamps, np.full(len(stamps), 0.3 * 1.05), np.full(len(stamps), 0.1)])
    felt[:, 2] += rng.normal(0.0, 0.02, len(stamps))
    rows = [row for pose in truth[5::7] for row in _seen(pose, rng)]
    return Robot(1, felt, np.array(rows), truth, 0)


def _seen(pose: Floats, rng: np.random.Generator) -> list[tuple[float, int, float, float]]:
    rows = []
    for subject, (x, y) in LANDMARKS.items():
        off = x - pose[1], y - pose[2]
        bearing = math.remainder(math.atan2(off[1], off[0]) - pose[3], math.tau)
        if math.hypot(*off) < SEES_M and abs(bearing) < 0.6:
            depth_m = math.hypot(*off) * math.cos(bearing) * (1 + rng.normal(0.0, 0.03))
            rows.append((float(pose[0]), subject, depth_m, bearing + rng.normal(0.0, 0.017)))
    return rows


def _truth(robot: Robot, stamps_s: Floats) -> Floats:
    return np.column_stack(
        [np.interp(stamps_s, robot.truth[:, 0], robot.truth[:, k]) for k in (1, 2, 3)]
    )


def test_on_a_known_map_the_robot_knows_where_it_is_all_the_time(robot: Robot) -> None:
    heard = list(moments(robot))
    path = follow(heard, LANDMARKS, (0.0, 0.0, 0.0), 0).online
    truth = _truth(robot, np.array([moment.stamp_s for moment in heard]))
    off_m = np.hypot(*(path[:, :2] - truth[:, :2]).T)
    assert np.sqrt(np.square(off_m).mean()) < 0.25
    assert off_m.max() < 1.0


def test_on_a_map_of_its_own_the_corrected_path_is_better_than_what_was_believed_and_than_path_integration(
    robot: Robot,
) -> None:
    heard = list(moments(robot))
    drive = follow(heard, {}, (0.0, 0.0, 0.0), 0)
    stamps = np.array([moment.stamp_s for moment in heard])
    truth = _truth(robot, stamps)[:, :2]
    corrected, online, integrated = (
        trajectory_error_m(path[:, :2], truth)
        for path in (drive.corrected(stamps), drive.online, drive.odometry)
    )
    assert corrected < 0.15
    assert corrected < min(online, integrated)


def test_the_truth_does_not_reach_the_codelets(robot: Robot) -> None:
    blind = Robot(1, robot.odometry, robot.observations, robot.truth * np.nan, 0)
    one, other = (follow(moments(each), {}, (0.0, 0.0, 0.0), 0).online for each in (robot, blind))
    assert (one == other).all()


def test_how_late_the_wheels_turn_is_found_by_how_landmarks_turn() -> None:
    delay = Delay()
    late_s = 0.2
    for step in range(400):
        now_s = step * 0.1
        turned = math.sin(now_s - late_s)
        delay.see(np.array([[now_s, 6, 3.0, -turned]]), np.sin)
    assert delay.lag_s == pytest.approx(late_s, abs=0.026)
