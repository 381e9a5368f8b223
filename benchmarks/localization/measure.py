"""The metrics of localization and mapping on one MRCLAM set."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import optional
from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.localization import speed
from benchmarks.localization.drives import evaluate
from benchmarks.localization.recovery import evaluate_recovery
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.progress import bar
from cogmap.data.mrclam import read
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
OPTIONS = (
    path_option(
        "--mrclam",
        "folder",
        required=True,
        metavar="DIR",
        text="A folder of the UTIAS MRCLAM sets, as published, its files packed or not.",
    ),
    PROCESSES,
)
OF_EACH_ROBOT = ("known_map_rmse_m", "slam_rmse_m", "smoother_rmse_m")


def measure(setting: Setting, *, folder: Path) -> Metrics:
    """Measure how well real robots localize, on a map that is known and on one that they make, and
    how fast.

    Each of the set's robots alone, through the town's workspace and codelets; observations of other
    robots are left out. The map that it makes is aligned with the truth, and compared with gtsam's
    batch smoother, which `make bench-setup` installs. Takes some minutes.
    """
    optional.gtsam()
    recording = read(folder)
    timings = speed.measure()

    with bar("robots' logs") as progress:
        work = partial(evaluate, landmarks=recording.landmarks)
        rows = parallel_map(work, recording.robots, setting.processes, progress)

    with bar("recoveries") as progress:
        work = partial(evaluate_recovery, landmarks=recording.landmarks)
        recoveries = parallel_map(work, recording.robots, setting.processes, progress)

    metrics = _means(rows)
    metrics["slam_vs_smoother"] = metrics["slam_rmse_m"] / metrics["smoother_rmse_m"]
    metrics |= _means(recoveries)
    metrics["recovery_worst_s"] = max(row["recovery_worst_s"] for row in recoveries)
    metrics |= timings

    for robot, row in zip(recording.robots, rows, strict=True):
        for key in OF_EACH_ROBOT:
            metrics[f"robot{robot.number}_{key}"] = row[key]

    observed = sum(len(robot.landmark_observations) for robot in recording.robots)
    metrics["landmark_sightings"] = float(observed)
    metrics["unread_barcodes"] = float(sum(robot.unread for robot in recording.robots))
    return metrics


def _means(rows: Sequence[Metrics]) -> Metrics:
    """Return the means over the robots."""
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
