"""The metrics of localization and mapping on one MRCLAM set."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import optional
from benchmarks.localization import speed
from benchmarks.localization.drives import evaluate
from benchmarks.localization.recovery import evaluate_recovery
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.progress import bar
from cogmap.data.mrclam import Recording, read
from cogmap.parallel import parallel_map

THRESHOLDS = {
    "known_map_rmse_m": at_most(0.13),
    "slam_rmse_m": at_most(0.25),
    "slam_online_rmse_m": at_most(0.22),
    "slam_vs_smoother": at_most(1.5),
    "update_ms_p99": at_most(1.5),
    "update_and_landmarks_ms_p99": at_most(4.0),
    "map_size_ratio": at_most(1.2),
    "recovery_s": at_most(15.0),
    "recovery_worst_s": at_most(40.0),
}
OF_EACH_ROBOT = ("known_map_rmse_m", "slam_rmse_m", "smoother_rmse_m")


def measure(folder: Path, processes: int) -> Metrics:
    """The metrics of THRESHOLDS, each the mean over the robots, and others that explain them.

    Raises UsageError where `folder` is no set, or gtsam or evo is not installed.
    """
    optional.gtsam()
    recording = read(folder)
    timings = speed.measure()

    with bar("robots' logs") as progress:
        work = partial(evaluate, landmarks=recording.landmarks)
        rows = parallel_map(work, recording.robots, processes, progress)

    metrics: Metrics = {}
    for key in rows[0]:
        of_robots = [row[key] for row in rows]
        metrics[key] = float(np.mean(of_robots))

    metrics["slam_vs_smoother"] = metrics["slam_rmse_m"] / metrics["smoother_rmse_m"]
    metrics |= _recovery(recording, processes)
    return metrics | timings | _of_each_robot(recording, rows) | _counts(recording)


def _recovery(recording: Recording, processes: int) -> Metrics:
    """The means over the robots, and the worst of all."""
    with bar("recoveries") as progress:
        work = partial(evaluate_recovery, landmarks=recording.landmarks)
        rows = parallel_map(work, recording.robots, processes, progress)

    worst_s = max(row["recovery_worst_s"] for row in rows)
    means = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    return means | {"recovery_worst_s": worst_s}


def _of_each_robot(recording: Recording, rows: Sequence[Metrics]) -> Metrics:
    metrics = {}
    for robot, row in zip(recording.robots, rows, strict=True):
        for key in OF_EACH_ROBOT:
            metrics[f"robot{robot.number}_{key}"] = row[key]

    return metrics


def _counts(recording: Recording) -> Metrics:
    observations = 0
    unread = 0
    for robot in recording.robots:
        observations += len(robot.landmark_observations)
        unread += robot.unread

    return {
        "landmark_sightings": float(observations),
        "unread_barcodes": float(unread),
    }
