"""The localization benchmark on a drive that is made up, through the workspace and a worker."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from benchmarks.localization import left_out, particle_filter, smoother
from benchmarks.localization.drives import follow
from benchmarks.localization.loop import LOCALIZATION, LocalizationLoop
from benchmarks.localization.measure import best_noise
from benchmarks.localization.senses import label_of, moments
from benchmarks.optional import trajectory_error_m
from cogmap.data.mrclam import Robot
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.schemas.graph import Delta, Phase
from cogmap.services.player.public import Delay

LANDMARKS = {6: (0.0, 4.0), 7: (5.0, 5.0), 8: (6.0, -1.0), 9: (-2.0, -2.0), 10: (2.0, 1.5)}
RATE_HZ = 10
LASTS_S = 200.0
SEES_M = 6.0
START = (0.0, 0.0, 0.0)
RADIUS_M = 3.0
TURN_RATE_RAD_S = 0.1
SPEED_M_S = RADIUS_M * TURN_RATE_RAD_S


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Round a circle of 3 m with wheels that slip by 5 % and drift, and an eye that is wrong by 3 %
    and 1°.
    """
    rng = np.random.default_rng(8)
    stamps_s = np.arange(0.0, LASTS_S, 1 / RATE_HZ)
    heading = TURN_RATE_RAD_S * stamps_s
    x_m = RADIUS_M * np.sin(heading)
    y_m = RADIUS_M - RADIUS_M * np.cos(heading)
    truth = np.column_stack([stamps_s, x_m, y_m, heading])

    odometry = np.empty((len(stamps_s), 3))
    odometry[:, 0] = stamps_s
    odometry[:, 1] = SPEED_M_S * 1.05
    odometry[:, 2] = TURN_RATE_RAD_S + rng.normal(0.0, 0.02, len(stamps_s))

    observations = []
    for pose in truth[5::7]:
        observations += _seen(pose, rng)
    return Robot(1, odometry, np.array(observations), truth, 0)


def _seen(pose: Floats, rng: np.random.Generator) -> list[tuple[float, int, float, float]]:
    """The landmarks ahead from a row of the truth: stamp, subject, depth and bearing."""
    stamp_s, x_m, y_m, heading_rad = pose.tolist()
    rows = []
    for subject, (landmark_x_m, landmark_y_m) in LANDMARKS.items():
        ahead_m = math.hypot(landmark_x_m - x_m, landmark_y_m - y_m)
        direction = math.atan2(landmark_y_m - y_m, landmark_x_m - x_m)
        bearing = math.remainder(direction - heading_rad, math.tau)
        if ahead_m < SEES_M and abs(bearing) < 0.6:
            depth_m = ahead_m * math.cos(bearing) * (1 + rng.normal(0.0, 0.03))
            rows.append((stamp_s, subject, depth_m, bearing + rng.normal(0.0, 0.017)))

    return rows


def _truth(robot: Robot, stamps_s: Floats) -> Floats:
    at_s = robot.truth[:, 0]
    columns = [np.interp(stamps_s, at_s, robot.truth[:, k]) for k in (1, 2, 3)]
    return np.column_stack(columns)


def _error_m(path: Floats, truth: Floats) -> Floats:
    off_m = path[:, :2] - truth[:, :2]
    return np.asarray(np.hypot(off_m[:, 0], off_m[:, 1]))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.square(values).mean()))


def _centred(path: Floats) -> npt.NDArray[np.complex128]:
    """Positions about their mean, as complex numbers."""
    positions = path[:, 0] + 1j * path[:, 1]
    return positions - positions.mean()


def _aligned_rms(path: Floats, truth: Floats) -> float:
    """Of the distances that are left once the path is moved and turned to fit the truth best."""
    found = _centred(path)
    true = _centred(truth)
    turn = (true * found.conj()).sum()
    aligned = found * turn / abs(turn)
    return _rms(np.abs(true - aligned))


def test_on_a_known_map_the_robot_is_localized_all_the_time(robot: Robot) -> None:
    log = list(moments(robot))
    path = follow(log, LANDMARKS, START, 0).online

    stamps_s = np.array([moment.stamp_s for moment in log])
    error_m = _error_m(path, _truth(robot, stamps_s))
    assert _rms(error_m) < 0.25
    assert error_m.max() < 1.0


def test_on_its_own_map_the_corrected_path_beats_belief_and_odometry(robot: Robot) -> None:
    log = list(moments(robot))
    drive = follow(log, {}, START, 0)
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth = _truth(robot, stamps_s)

    corrected = _aligned_rms(drive.corrected(stamps_s), truth)
    believed = _aligned_rms(drive.online, truth)
    by_odometry = _aligned_rms(drive.odometry, truth)

    assert corrected < 0.15
    assert corrected < believed
    assert corrected < by_odometry


def _followed(robot: Robot, seed: int = 0, steps: int = 50) -> Floats:
    """The beginning of the path that is believed without a known map."""
    log = list(moments(robot))[:steps]
    return follow(log, {}, START, seed).online


def test_the_truth_does_not_reach_the_codelets(robot: Robot) -> None:
    nowhere = robot.truth * np.nan
    blind = Robot(1, robot.odometry, robot.observations, nowhere, 0)

    seeing_path = _followed(robot, steps=300)
    blind_path = _followed(blind, steps=300)

    assert (blind_path == seeing_path).all()


def test_another_seed_is_other_noise_of_the_codelets(robot: Robot) -> None:
    first = _followed(robot, seed=0)
    other = _followed(robot, seed=1)

    assert (other != first).any()


def test_the_workers_time_for_each_task_is_known(robot: Robot) -> None:
    loop = LocalizationLoop((0.0, 0.0, 0.0))
    names = []
    total_s = 0.0

    for moment in list(moments(robot))[:20]:
        loop.live(moment)
        names += [name for name, _ in loop.task_s]
        total_s += sum(took_s for _, took_s in loop.task_s)

    loop.close()
    assert names.count(LOCALIZATION) == 20
    assert "object_place" in names
    assert total_s > 0


def test_an_answer_that_is_late_is_counted_and_any_other_ends_the_run(robot: Robot) -> None:
    loop = LocalizationLoop(START)
    first, second, *_ = moments(robot)
    loop.live(first)

    loop.count_rejected(rejecting("proposal 1/correct is late: map:1 has changed since 4"))
    loop.live(second)
    assert loop.late_answers == 1

    loop.count_rejected(rejecting("proposal 1/correct failed: out of memory"))
    with pytest.raises(CogmapError, match="out of memory"):
        loop.live(second)


def rejecting(reason: str) -> Delta:
    return Delta(version=1, cycle=1, phase=Phase.END, operations=[], rejected=1, reasons=[reason])


def test_a_trajectory_error_depends_on_its_scale_but_not_on_its_frame() -> None:
    pytest.importorskip("evo")
    truth = np.random.default_rng(0).normal(0.0, 10.0, (50, 2))
    turned = truth @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + (3.0, -5.0)
    mirrored = truth * (-1, 1)
    larger = 1.1 * truth

    assert trajectory_error_m(turned, truth) == pytest.approx(0.0, abs=1e-9)
    assert trajectory_error_m(mirrored, truth) > 5.0
    assert trajectory_error_m(larger, truth) > 0.5


def test_the_wheels_delay_is_found_by_how_landmarks_turn() -> None:
    delay = Delay()
    late_s = 0.2

    for step in range(400):
        now_s = step * 0.1
        turned = math.sin(now_s - late_s)
        delay.observe(np.array([[now_s, 6, 3.0, -turned]]), np.sin)

    assert delay.lag_s == pytest.approx(late_s, abs=0.026)


def test_the_particle_filter_localizes_the_robot_on_a_known_map(robot: Robot) -> None:
    log = list(moments(robot))
    surveyed = {label_of(subject): where for subject, where in LANDMARKS.items()}
    path = particle_filter.localize(log, surveyed, START, (2.0, 1.0), 0)
    again = particle_filter.localize(log, surveyed, START, (2.0, 1.0), 0)

    stamps_s = np.array([moment.stamp_s for moment in log])
    assert _rms(_error_m(path, _truth(robot, stamps_s))) < 0.25
    assert (path == again).all()


def test_a_robot_that_is_left_out_has_the_constants_that_the_others_choose() -> None:
    by_robot_m = np.array([[0.1, 0.5], [0.3, 0.2], [0.3, 0.2]])

    # The first robot's others err least with the second, the others' with the first.
    assert left_out.left_out_error_m(by_robot_m) == pytest.approx((0.5 + 0.3 + 0.3) / 3)


def test_our_constants_are_not_driven_again_to_be_left_out() -> None:
    others = 2 * len(left_out.CONSTANTS)
    worse_m = [0.2] * others + [0.6] * others

    metrics = left_out.summary([0.1, 0.3], worse_m)

    assert metrics[left_out.KEY] == pytest.approx(0.2)
    assert metrics["known_map_range_gain_sd_doubled_over_ours"] == pytest.approx(2.0)


def test_constants_are_halved_and_doubled_one_at_a_time() -> None:
    found = dict(left_out.candidates())

    assert found["ours"] == {}
    assert found["range_gain_sd_doubled"] == {"range_gain_sd": pytest.approx(0.06)}
    assert len(found) == 1 + 2 * len(left_out.CONSTANTS)


def test_a_peer_has_the_noise_that_it_errs_least_with() -> None:
    means = {"isam2_rmse_m_0": 0.3, "isam2_rmse_m_1": 0.1, "isam2_rmse_m_2": 0.2}

    assert best_noise(means, "isam2_rmse_m", 3) == 1


def test_our_rule_gives_a_peer_the_least_variance_of_a_step() -> None:
    step = np.array([0.3, 0.4, -0.2])
    exact = np.full(3, 1e-4)

    sds = smoother.with_noise(step, exact, smoother.Noise(1.0, 1.0, 0.02, 0.06, 0.5))

    assert sds[0] == pytest.approx(math.sqrt(0.02 * 0.5))
    assert sds[2] == pytest.approx(math.sqrt(0.06 * 0.5 + 0.5 * 0.2))
    assert (smoother.with_noise(step, exact, smoother.Noise(2.0)) == 2 * exact).all()
