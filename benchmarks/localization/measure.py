"""The figures of localization and mapping on one MRCLAM set."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import track

from benchmarks.localization import smoother, speed
from benchmarks.localization.loop import Mind
from benchmarks.localization.senses import Moment, label_of, moments
from benchmarks.map_correction.measure import trajectory_error_m
from benchmarks.threshold import at_most
from cogmap.data.mrclam import Recording, Robot, read
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from services.codelets.mapping.path import ODOMETRY, POSE, STAMP

THRESHOLDS = {
    "known_map_rmse_m": at_most(0.15),
    "slam_rmse_m": at_most(0.25),
    "slam_vs_smoother": at_most(1.5),
    "update_ms_p99": at_most(2.0),
    "map_size_ratio": at_most(1.2),
}
SEEDS = (0, 1)
TRUTH_GAP_S = 0.5
CARRIED_S = (300.0, 360.0)
FOUND_M = 0.5
Landmarks = dict[int, tuple[float, float]]


def measure(folder: Path, processes: int) -> dict[str, float]:
    """Every figure of THRESHOLDS, and others that tell how it came about. Raises UsageError where
    `folder` is no set.
    """
    smoother.check_installed()
    recording = read(folder)
    figures = speed.measure()
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        work = partial(judge, landmarks=recording.landmarks)
        told = pool.map(work, recording.robots)
        rows = list(track(told, "driving", total=len(recording.robots), transient=True))
    means = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    means["slam_vs_smoother"] = means["slam_rmse_m"] / means["smoother_rmse_m"]
    each = {
        f"robot{robot.number}_{key}": row[key]
        for key in ("known_map_rmse_m", "slam_rmse_m", "smoother_rmse_m")
        for robot, row in zip(recording.robots, rows, strict=True)
    }
    return means | figures | each | _told(recording)


def _told(recording: Recording) -> dict[str, float]:
    return {
        "landmark_sightings": float(
            sum(len(robot.landmark_observations) for robot in recording.robots)
        ),
        "unread_barcodes": float(sum(robot.unread for robot in recording.robots)),
    }


def judge(robot: Robot, landmarks: Landmarks) -> dict[str, float]:
    """The errors of one robot, each the mean over SEEDS.

    `slam_rmse_m` is of the path as the map has it in the end, as the smoother's is;
    `slam_online_rmse_m` of what was believed at each moment, when no later sighting had corrected
    it.
    """
    heard = list(moments(robot))
    stamps = np.array([moment.stamp_s for moment in heard])
    truth, judged = _truth(robot, stamps)
    even = judged & np.array([moment.tick for moment in heard])
    known = [
        follow(heard, landmarks, tuple(_truth(robot, robot.odometry[:1, 0])[0][0]), seed)
        for seed in SEEDS
    ]
    slam = [follow(heard, {}, (0.0, 0.0, 0.0), seed) for seed in SEEDS]

    def aligned_m(path: Floats) -> float:
        return trajectory_error_m(path[judged, :2], truth[judged, :2])

    return {
        "known_map_rmse_m": float(
            np.mean([_rmse(drive.online[judged], truth[judged]) for drive in known])
        ),
        "known_map_rmse_even_m": float(
            np.mean([_rmse(drive.online[even], truth[even]) for drive in known])
        ),
        "slam_rmse_m": float(np.mean([aligned_m(drive.corrected(stamps)) for drive in slam])),
        "slam_online_rmse_m": float(np.mean([aligned_m(drive.online) for drive in slam])),
        "smoother_rmse_m": aligned_m(smoother.smooth(heard)),
        "recovery_s": _recovery_s(robot, landmarks),
    }


class Drive(NamedTuple):
    """What was believed of a drive: (n, 3) poses `online` and by path integration at each moment;
    `path` in the end.
    """

    online: Floats
    odometry: Floats
    path: Floats

    def corrected(self, stamps_s: Floats) -> Floats:
        """(n, 3) poses at the moments as the map has them in the end: each by the path's last place
        before it.
        """
        places = (np.searchsorted(self.path[:, STAMP], stamps_s + 1e-6) - 1).clip(0)
        steps = zip(self.path[places], self.odometry, strict=True)
        return np.array(
            [compose(place[POSE], relative(place[ODOMETRY], now)) for place, now in steps]
        )


def follow(
    heard: Iterable[Moment], landmarks: Landmarks, start: tuple[float, ...], seed: int
) -> Drive:
    """What the codelets make of what was heard."""
    mind = Mind((start[0], start[1], start[2]), seed=seed)
    if landmarks:
        mind.learn(
            {label_of(subject): where for subject, where in landmarks.items()}, surveyed=True
        )
    poses = []
    odometry = []
    for moment in heard:
        mind.live(moment)
        poses.append(mind.pose)
        odometry.append(mind.odometry)
    return Drive(np.array(poses), np.array(odometry), mind.path)


def _recovery_s(robot: Robot, landmarks: Landmarks) -> float:
    """How long after it was carried away it takes the robot to know, within FOUND_M and for good,
    where it is.

    A minute of its log never reaches it: neither that it moved nor what it saw. Counted from its
    next sighting on.
    """
    begin_s = float(robot.odometry[0, 0])
    heard = [
        moment
        for moment in moments(robot, CARRIED_S)
        if moment.stamp_s < begin_s + 2 * CARRIED_S[1]
    ]
    stamps = np.array([moment.stamp_s for moment in heard])
    truth, judged = _truth(robot, stamps)
    path = follow(heard, landmarks, tuple(_truth(robot, robot.odometry[:1, 0])[0][0]), 0).online
    seen = np.array([bool(moment.percepts) for moment in heard])
    after = np.flatnonzero(seen & judged & (stamps > begin_s + CARRIED_S[1]))
    if not len(after):
        return 0.0
    off = np.hypot(*(path[after, :2] - truth[after, :2]).T)
    lost = np.flatnonzero(off > FOUND_M)
    found = after[min(lost[-1] + 1, len(after) - 1)] if len(lost) else after[0]
    return float(stamps[found] - stamps[after[0]])


def _rmse(path: Floats, truth: Floats) -> float:
    return float(np.sqrt(np.square(path[:, :2] - truth[:, :2]).sum(axis=1).mean()))


def _truth(robot: Robot, stamps_s: Floats) -> tuple[Floats, np.ndarray]:
    """(n, 3) true poses at `stamps_s`, and where motion capture saw the robot just before and just
    after.
    """
    known_s = robot.truth[:, 0]
    columns = (robot.truth[:, 1], robot.truth[:, 2], np.unwrap(robot.truth[:, 3]))
    poses = np.column_stack([np.interp(stamps_s, known_s, column) for column in columns])
    after = np.searchsorted(known_s, stamps_s).clip(1, len(known_s) - 1)
    near = known_s[after] - known_s[after - 1] <= TRUTH_GAP_S
    return poses, near & (stamps_s >= known_s[0]) & (stamps_s <= known_s[-1])
