"""The metrics of localization and mapping on the logs of others."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import click
import numpy as np

from benchmarks import optional
from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.localization import (
    beacons,
    left_out,
    particle_filter,
    smoother,
    speed,
    without_names,
)
from benchmarks.localization import trees as tree_drive
from benchmarks.localization.drives import (
    FILTER_KEY,
    FIRST_KNOWN_KEY,
    ISAM2_KEY,
    SMOOTHER_KEY,
    evaluate,
)
from benchmarks.localization.recovery import evaluate_recovery
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.progress import bar
from cogmap.data.mrclam import read
from cogmap.errors import UsageError
from cogmap.parallel import parallel_map

THRESHOLDS = {
    "slam_online_rmse_m": at_most(0.22),
    "slam_online_over_isam2": at_most(1.1),
    "known_map_rmse_m": at_most(0.13),
    "known_map_over_filter": at_most(1.0),
    "slam_rmse_m": at_most(0.25),
    "slam_vs_smoother": at_most(1.2),
    "update_ms_p99": at_most(1.5),
    "update_and_landmarks_ms_p99": at_most(4.0),
    "map_size_ratio": at_most(1.2),
    "recovery_s": at_most(15.0),
    "recovery_worst_s": at_most(60.0),
} | left_out.THRESHOLDS
OPTION_THRESHOLDS = without_names.THRESHOLDS | tree_drive.THRESHOLDS | beacons.THRESHOLDS
OPTIONS = (
    path_option(
        "--mrclam",
        "folder",
        metavar="DIR",
        text="A folder of the UTIAS MRCLAM sets, as published, its files packed or not.",
    ),
    click.Option(
        ["--without-names", "is_without_names"],
        is_flag=True,
        help="Of --mrclam: measure only how well maps are made if the barcodes are withheld.",
    ),
    path_option(
        "--trees",
        metavar="DIR",
        text="Measure only a car among trees without names: DIR has odometry.csv, trees.csv and "
        "gps.csv, as Victoria Park's.",
    ),
    path_option(
        "--ranges",
        metavar="DIR",
        text="Measure only a robot that hears beacons at a range: DIR has odometry.csv, "
        "ranges.csv, truth.csv and beacons.csv, as Plaza 1's.",
    ),
    PROCESSES,
)
PEERS = {
    ISAM2_KEY: len(smoother.NOISES),
    FILTER_KEY: len(particle_filter.SCALES),
    SMOOTHER_KEY: len(smoother.NOISES),
}
"""How many noises each peer is measured with: the least mean error over the robots is its own."""
OF_EACH_ROBOT = ("slam_online_rmse_m", "known_map_rmse_m", "slam_rmse_m")


def measure(
    setting: Setting,
    *,
    folder: Path | None = None,
    is_without_names: bool = False,
    trees: Path | None = None,
    ranges: Path | None = None,
) -> Metrics:
    """Measure how well real robots localize, on a map that is known and on one that they make, and
    how fast.

    Each of the set's robots alone, through the town's workspace and codelets; observations of other
    robots are left out. The map that it makes is aligned with the truth, and compared with gtsam's
    batch smoother and with its iSAM2, localization on the known map with the particle filter of
    pfilter: `make bench-setup` installs them. Takes most of an hour. --trees, --ranges and
    --without-names measure maps alone, beside gtsam's or beside those with names.
    """
    if is_without_names and folder is None:
        raise UsageError("--without-names is of --mrclam: give that folder too")
    if trees is None and ranges is None and folder is None:
        raise UsageError("there is nothing to measure on: give --mrclam, --trees or --ranges")

    metrics: Metrics = {}
    if trees is not None:
        metrics |= tree_drive.measure(trees)
    if ranges is not None:
        metrics |= beacons.measure(ranges)
    if folder is not None and is_without_names:
        metrics |= _measure_without_names(setting, folder)
    elif folder is not None:
        metrics |= _measure_robots(setting, folder)
    return metrics


def _measure_without_names(setting: Setting, folder: Path) -> Metrics:
    optional.gtsam()
    recording = read(folder)
    with bar("robots' logs without names") as progress:
        work = without_names.evaluate_without_names
        rows = parallel_map(work, recording.robots, setting.processes, progress)
    return without_names.summary(recording.robots, rows)


def _measure_robots(setting: Setting, folder: Path) -> Metrics:
    optional.gtsam()
    optional.pfilter()
    recording = read(folder)
    timings = speed.measure()

    with bar("robots' logs") as progress:
        work = partial(evaluate, landmarks=recording.landmarks)
        rows = parallel_map(work, recording.robots, setting.processes, progress)

    with bar("recoveries") as progress:
        work = partial(evaluate_recovery, landmarks=recording.landmarks)
        recoveries = parallel_map(work, recording.robots, setting.processes, progress)

    with bar("constants that others choose") as progress:
        candidate = partial(left_out.evaluate_candidate, landmarks=recording.landmarks)
        errors_m = parallel_map(candidate, left_out.jobs(recording), setting.processes, progress)

    ours_m = [row.pop(FIRST_KNOWN_KEY) for row in rows]
    metrics = _means(rows)
    chosen = {key: best_noise(metrics, key, count) for key, count in PEERS.items()}
    for key, count in PEERS.items():
        metrics[key] = metrics[f"{key}_{chosen[key]}"]
        for number in range(count):
            del metrics[f"{key}_{number}"]

    metrics["slam_online_over_isam2"] = metrics["slam_online_rmse_m"] / metrics[ISAM2_KEY]
    metrics["known_map_over_filter"] = metrics["known_map_rmse_m"] / metrics[FILTER_KEY]
    metrics["slam_vs_smoother"] = metrics["slam_rmse_m"] / metrics[SMOOTHER_KEY]
    metrics |= left_out.summary(ours_m, errors_m)
    metrics |= _means(recoveries)
    metrics["recovery_worst_s"] = max(row["recovery_worst_s"] for row in recoveries)
    metrics |= timings

    for robot, row in zip(recording.robots, rows, strict=True):
        for key in OF_EACH_ROBOT:
            metrics[f"robot{robot.number}_{key}"] = row[key]
        for key, number in chosen.items():
            metrics[f"robot{robot.number}_{key}"] = row[f"{key}_{number}"]

    observed = sum(len(robot.landmark_observations) for robot in recording.robots)
    metrics["landmark_sightings"] = float(observed)
    metrics["unread_barcodes"] = float(sum(robot.unread for robot in recording.robots))
    return metrics


def best_noise(means: Metrics, peer: str, count: int) -> int:
    """Return which of so many noises a peer errs least with, by the `means` over the robots."""
    return min(range(count), key=lambda number: float(means[f"{peer}_{number}"]))


def _means(rows: Sequence[Metrics]) -> Metrics:
    """Return the means over the robots."""
    return {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
