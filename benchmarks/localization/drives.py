"""One robot's log through the loop, and the errors of its estimates by motion capture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.localization import particle_filter, smoother
from benchmarks.localization.loop import Landmarks, LocalizationLoop
from benchmarks.localization.senses import Moment, label_of, moments
from benchmarks.localization.truth import Truth
from benchmarks.report import Metrics
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from cogmap.parallel import Progress

SEEDS = (0, 1)
ORIGIN = (0.0, 0.0, 0.0)
STAMP_COLUMN = 0
POSE_COLUMNS = slice(1, 4)
ODOMETRY_COLUMNS = slice(4, 7)
STAMP_TOLERANCE_S = 1e-6
FILTER_KEY = "filter_rmse_m"
ISAM2_KEY = "isam2_rmse_m"
SMOOTHER_KEY = "smoother_rmse_m"
FIRST_KNOWN_KEY = "known_map_first_rmse_m"


class Drive(NamedTuple):
    """The estimates on a drive: (n, 3) poses `online` and by path integration at each moment.

    `path` (m, 7) is the path on the map in the end: stamp_s, pose, pose by path integration.
    `late_answers` is how many answers of background codelets came too late to be committed;
    `individuals` how many objects the map has in the end that were seen more than once.
    """

    online: Floats
    odometry: Floats
    path: Floats
    late_answers: int
    individuals: int

    def corrected(self, stamps_s: Floats) -> Floats:
        """Return (n, 3) poses at the moments as the map has them in the end.

        Each is by path integration from the last place of the path before it.
        """
        place_stamps_s = self.path[:, STAMP_COLUMN]
        later = np.searchsorted(place_stamps_s, stamps_s + STAMP_TOLERANCE_S)
        before = (later - 1).clip(0)
        places = self.path[before]
        poses = []

        for place, now in zip(places, self.odometry, strict=True):
            step = relative(place[ODOMETRY_COLUMNS], now)
            poses.append(compose(place[POSE_COLUMNS], step))

        return np.array(poses)


def follow(
    log: Sequence[Moment],
    surveyed: dict[int, tuple[float, float]],
    start: tuple[float, float, float],
    seed: int,
    *,
    settings: Mapping[str, object] | None = None,
    progress: Progress = lambda share: None,
) -> Drive:
    """Run a log through the workspace and a worker, from `start`, on a map of `surveyed` landmarks.

    Without any it makes a map of its own. `settings` are those of LocalizationLoop.
    """
    landmarks: Landmarks = {label_of(subject): where for subject, where in surveyed.items()}
    loop = LocalizationLoop(start, landmarks, bool(landmarks), seed, settings)
    poses = []
    odometry = []

    for number, moment in enumerate(log):
        loop.live(moment)
        progress(number / len(log))
        poses.append(loop.pose)
        odometry.append(loop.odometry)

    path = loop.path
    individuals = loop.individuals
    loop.close()
    return Drive(np.array(poses), np.array(odometry), path, loop.late_answers, individuals)


def evaluate(robot: Robot, landmarks: dict[int, tuple[float, float]]) -> Metrics:
    """Return the errors of one robot, each the mean over SEEDS.

    `slam_online_rmse_m` is of the estimate at each moment, before later observations corrected it,
    as `isam2_rmse_m_0` and so on are, by the smoother's NOISES; `slam_rmse_m` is of the path as the
    map has it in the end, as `smoother_rmse_m_0` and so on are. `filter_rmse_m_0` and so on are of
    the particle filter by its SCALES. `*_even_m` is of the moments at even times alone,
    `known_map_first_rmse_m` of the first of SEEDS alone.
    """
    log = list(moments(robot))
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth = Truth.at(robot, stamps_s)
    even = truth.only(np.array([moment.tick for moment in log]))
    start_x_m, start_y_m, start_rad = Truth.at(robot, robot.odometry[:1, 0]).poses[0].tolist()
    start = (start_x_m, start_y_m, start_rad)
    surveyed = {label_of(subject): where for subject, where in landmarks.items()}

    known = []
    mapping = []
    for seed in SEEDS:
        known.append(follow(log, landmarks, start, seed).online)
        mapping.append(follow(log, {}, ORIGIN, seed))

    in_the_end_m = [truth.aligned_error_m(drive.corrected(stamps_s)) for drive in mapping]
    online_m = [truth.aligned_error_m(drive.online) for drive in mapping]
    errors: Metrics = {
        "slam_online_rmse_m": float(np.mean(online_m)),
        "known_map_rmse_m": float(np.mean([truth.rmse_m(path) for path in known])),
        FIRST_KNOWN_KEY: truth.rmse_m(known[0]),
        "known_map_rmse_even_m": float(np.mean([even.rmse_m(path) for path in known])),
        "slam_rmse_m": float(np.mean(in_the_end_m)),
        "path_integration_rmse_m": truth.aligned_error_m(mapping[0].odometry),
        "late_answers": float(sum(drive.late_answers for drive in mapping)),
    }

    for number, noise in enumerate(smoother.NOISES):
        errors[f"{ISAM2_KEY}_{number}"] = _isam2_error_m(log, truth, noise)
        errors[f"{SMOOTHER_KEY}_{number}"] = truth.aligned_error_m(smoother.smooth(log, noise))

    for number, scales in enumerate(particle_filter.SCALES):
        filtered = particle_filter.localize(log, surveyed, start, scales, SEEDS[0])
        errors[f"{FILTER_KEY}_{number}"] = truth.rmse_m(filtered)
    return errors


def _isam2_error_m(log: Sequence[Moment], truth: Truth, noise: smoother.Noise) -> float:
    """Return the error of iSAM2's estimates; infinite if its system is indeterminate with a noise,
    which gtsam raises RuntimeError for.
    """
    try:
        online = smoother.smooth_online(log, noise)
    except RuntimeError:
        return math.inf
    return truth.aligned_error_m(online)
