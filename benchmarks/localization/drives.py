"""One robot's log through the loop, and how far what it believes is from motion capture's truth."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from benchmarks.localization import smoother
from benchmarks.localization.loop import Landmarks, LocalizationLoop
from benchmarks.localization.senses import Moment, label_of, moments
from benchmarks.report import Metrics
from benchmarks.trajectory import trajectory_error_m
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative

SEEDS = (0, 1)
ORIGIN = (0.0, 0.0, 0.0)
TRUTH_GAP_S = 0.5
KIDNAPPED_S = (300.0, 360.0)
FOUND_M = 0.5
STAMP_COLUMN = 0
POSE_COLUMNS = slice(1, 4)
ODOMETRY_COLUMNS = slice(4, 7)
STAMP_TOLERANCE_S = 1e-6


class Drive(NamedTuple):
    """What was believed of a drive: (n, 3) poses `online` and by path integration at each moment.

    `path` (m, 7) is the path on the map in the end: stamp_s, pose, pose by path integration.
    """

    online: Floats
    odometry: Floats
    path: Floats

    def corrected(self, stamps_s: Floats) -> Floats:
        """(n, 3) poses at the moments as the map has them in the end.

        Each is by path integration from the last place of the path before it.
        """
        later = np.searchsorted(self.path[:, STAMP_COLUMN], stamps_s + STAMP_TOLERANCE_S)
        places = self.path[(later - 1).clip(0)]
        poses = []

        for place, now in zip(places, self.odometry, strict=True):
            step = relative(place[ODOMETRY_COLUMNS], now)
            poses.append(compose(place[POSE_COLUMNS], step))

        return np.array(poses)


def follow(
    log: Iterable[Moment],
    surveyed: dict[int, tuple[float, float]],
    start: tuple[float, float, float],
    seed: int,
) -> Drive:
    """Run a log through the workspace and a worker, from `start`, on a map of `surveyed` landmarks.

    Without any it makes a map of its own.
    """
    landmarks: Landmarks = {label_of(subject): where for subject, where in surveyed.items()}
    loop = LocalizationLoop(start, landmarks, surveyed=bool(landmarks), seed=seed)
    poses = []
    odometry = []

    for moment in log:
        loop.live(moment)
        poses.append(loop.pose)
        odometry.append(loop.odometry)

    path = loop.path
    loop.close()
    return Drive(np.array(poses), np.array(odometry), path)


def evaluate(robot: Robot, landmarks: dict[int, tuple[float, float]]) -> Metrics:
    """The errors of one robot, each the mean over SEEDS.

    `slam_rmse_m` is of the path as the map has it in the end, as the smoother's is;
    `slam_online_rmse_m` of what was believed at each moment, before later observations corrected
    it. `*_even_m` is of the moments at even times alone.
    """
    log = list(moments(robot))
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth, is_known = true_poses(robot, stamps_s)
    is_even = is_known & np.array([moment.tick for moment in log])
    start = _start(robot)

    known = [follow(log, landmarks, start, seed) for seed in SEEDS]
    slam = [follow(log, {}, ORIGIN, seed) for seed in SEEDS]

    def aligned_error_m(path: Floats) -> float:
        return trajectory_error_m(path[is_known, :2], truth[is_known, :2])

    known_m = [_rmse_m(drive.online[is_known], truth[is_known]) for drive in known]
    known_even_m = [_rmse_m(drive.online[is_even], truth[is_even]) for drive in known]
    slam_m = [aligned_error_m(drive.corrected(stamps_s)) for drive in slam]
    slam_online_m = [aligned_error_m(drive.online) for drive in slam]

    return {
        "known_map_rmse_m": float(np.mean(known_m)),
        "known_map_rmse_even_m": float(np.mean(known_even_m)),
        "slam_rmse_m": float(np.mean(slam_m)),
        "slam_online_rmse_m": float(np.mean(slam_online_m)),
        "path_integration_rmse_m": aligned_error_m(slam[0].odometry),
        "smoother_rmse_m": aligned_error_m(smoother.smooth(log)),
        "recovery_s": recovery_s(robot, landmarks),
    }


def recovery_s(robot: Robot, landmarks: dict[int, tuple[float, float]]) -> float:
    """How long a kidnapped robot takes to localize within FOUND_M for good, on a known map.

    A minute of its log never reaches it: neither that it moved nor what it saw. Counted from its
    next observation on.
    """
    begin_s = float(robot.odometry[0, 0])
    end_s = begin_s + 2 * KIDNAPPED_S[1]
    log = [moment for moment in moments(robot, KIDNAPPED_S) if moment.stamp_s < end_s]
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth, is_known = true_poses(robot, stamps_s)
    online = follow(log, landmarks, _start(robot), 0).online

    observes = np.array([bool(moment.percepts) for moment in log])
    is_after = stamps_s > begin_s + KIDNAPPED_S[1]
    after = np.flatnonzero(observes & is_known & is_after)
    if not len(after):
        return 0.0

    error_m = np.hypot(*(online[after, :2] - truth[after, :2]).T)
    lost = np.flatnonzero(error_m > FOUND_M)
    first_found = min(lost[-1] + 1, len(after) - 1) if len(lost) else 0
    return float(stamps_s[after[first_found]] - stamps_s[after[0]])


def true_poses(robot: Robot, stamps_s: Floats) -> tuple[Floats, np.ndarray]:
    """(n, 3) true poses at `stamps_s`, and (n,) whether motion capture saw the robot then."""
    known_s = robot.truth[:, 0]
    heading_rad = np.unwrap(robot.truth[:, 3])
    columns = (robot.truth[:, 1], robot.truth[:, 2], heading_rad)
    poses = np.column_stack([np.interp(stamps_s, known_s, column) for column in columns])

    after = np.searchsorted(known_s, stamps_s).clip(1, len(known_s) - 1)
    is_near = known_s[after] - known_s[after - 1] <= TRUTH_GAP_S
    is_covered = (stamps_s >= known_s[0]) & (stamps_s <= known_s[-1])
    return poses, is_near & is_covered


def _start(robot: Robot) -> tuple[float, float, float]:
    """The true pose at the beginning of the log."""
    poses, _ = true_poses(robot, robot.odometry[:1, 0])
    x_m, y_m, heading_rad = poses[0].tolist()
    return x_m, y_m, heading_rad


def _rmse_m(path: Floats, truth: Floats) -> float:
    offset_m = path[:, :2] - truth[:, :2]
    return float(np.sqrt(np.square(offset_m).sum(axis=1).mean()))
