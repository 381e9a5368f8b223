"""The localization benchmark on a drive that is made up, through the workspace and a worker."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.localization.delay import Delay
from benchmarks.localization.drives import follow
from benchmarks.localization.loop import LOCALIZATION, LocalizationLoop
from benchmarks.localization.senses import moments
from benchmarks.trajectory import trajectory_error_m
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


def _error_m(path: Floats, truth: Floats) -> Floats:
    return np.asarray(np.hypot(*(path[:, :2] - truth[:, :2]).T))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.square(values).mean()))


def _aligned_rms(path: Floats, truth: Floats) -> float:
    """Of the distances that are left once the path is moved and turned to fit the truth best."""
    found = path[:, :2] - path[:, :2].mean(axis=0)
    true = truth[:, :2] - truth[:, :2].mean(axis=0)
    found_z = found[:, 0] + 1j * found[:, 1]
    true_z = true[:, 0] + 1j * true[:, 1]
    turn = (true_z * found_z.conj()).sum()
    return _rms(np.abs(true_z - found_z * turn / abs(turn)))


def test_on_a_known_map_the_robot_is_localized_all_the_time(robot: Robot) -> None:
    log = list(moments(robot))
    path = follow(log, LANDMARKS, (0.0, 0.0, 0.0), 0).online

    error_m = _error_m(path, _truth(robot, np.array([moment.stamp_s for moment in log])))

    assert _rms(error_m) < 0.25
    assert error_m.max() < 1.0


def test_on_its_own_map_the_corrected_path_beats_belief_and_odometry(robot: Robot) -> None:
    log = list(moments(robot))
    drive = follow(log, {}, (0.0, 0.0, 0.0), 0)
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth = _truth(robot, stamps_s)

    corrected = _aligned_rms(drive.corrected(stamps_s), truth)

    assert corrected < 0.15
    assert corrected < _aligned_rms(drive.online, truth)
    assert corrected < _aligned_rms(drive.odometry, truth)


def test_the_truth_does_not_reach_the_codelets(robot: Robot) -> None:
    blind = Robot(1, robot.odometry, robot.observations, robot.truth * np.nan, 0)
    seeing_log = list(moments(robot))[:300]
    blind_log = list(moments(blind))[:300]

    seeing = follow(seeing_log, {}, (0.0, 0.0, 0.0), 0).online

    assert (follow(blind_log, {}, (0.0, 0.0, 0.0), 0).online == seeing).all()


def test_another_seed_is_other_noise_of_the_codelets(robot: Robot) -> None:
    log = list(moments(robot))[:50]

    first = follow(log, {}, (0.0, 0.0, 0.0), 0).online

    assert (follow(log, {}, (0.0, 0.0, 0.0), 1).online != first).any()


def test_the_workers_time_for_each_task_is_known(robot: Robot) -> None:
    loop = LocalizationLoop((0.0, 0.0, 0.0))
    names = []

    for moment in list(moments(robot))[:20]:
        loop.live(moment)
        names += [name for name, took_s in loop.task_s if took_s > 0]

    loop.close()
    assert names.count(LOCALIZATION) == 20
    assert "object_place" in names


def test_a_trajectory_error_depends_on_its_scale_but_not_on_its_frame() -> None:
    pytest.importorskip("evo")
    truth = np.random.default_rng(0).normal(0.0, 10.0, (50, 2))
    turned = truth @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + (3.0, -5.0)

    assert trajectory_error_m(turned, truth) == pytest.approx(0.0, abs=1e-9)
    assert trajectory_error_m(truth * (-1, 1), truth) > 5.0
    assert trajectory_error_m(1.1 * truth, truth) > 0.5


def test_the_wheels_delay_is_found_by_how_landmarks_turn() -> None:
    delay = Delay()
    late_s = 0.2

    for step in range(400):
        now_s = step * 0.1
        turned = math.sin(now_s - late_s)
        delay.observe(np.array([[now_s, 6, 3.0, -turned]]), np.sin)

    assert delay.lag_s == pytest.approx(late_s, abs=0.026)
