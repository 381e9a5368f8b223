"""The metrics of localization and mapping on one MRCLAM set."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import optional
from benchmarks.localization import speed
from benchmarks.localization.drives import evaluate
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cli.log.progress import bar
from cogmap.data.mrclam import Recording, read
from cogmap.parallel import parallel_map

THRESHOLDS = {
    "known_map_rmse_m": at_most(0.15),
    "slam_rmse_m": at_most(0.25),
    "slam_vs_smoother": at_most(1.5),
    "update_ms_p99": at_most(2.0),
    "map_size_ratio": at_most(1.2),
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

    metrics = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    metrics["slam_vs_smoother"] = metrics["slam_rmse_m"] / metrics["smoother_rmse_m"]
    metrics |= timings

    for robot, row in zip(recording.robots, rows, strict=True):
        for key in OF_EACH_ROBOT:
            metrics[f"robot{robot.number}_{key}"] = row[key]

    return metrics | _counts(recording)


def _counts(recording: Recording) -> Metrics:
    observations = sum(len(robot.landmark_observations) for robot in recording.robots)
    unread = sum(robot.unread for robot in recording.robots)
    return {"landmark_sightings": float(observations), "unread_barcodes": float(unread)}
