"""MRCLAM's robots among landmarks whose barcodes are withheld: which is which must be found out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import msgspec
import numpy as np

from benchmarks.localization.drives import ORIGIN, SEEDS, Drive, follow
from benchmarks.localization.senses import Moment, moments
from benchmarks.localization.truth import Truth
from benchmarks.report import Metrics
from benchmarks.threshold import Thresholds, at_most, within
from cogmap.data.mrclam import Robot

THRESHOLDS: Thresholds = {
    "without_over_with_names": at_most(1.25),
    "individuals_over_landmarks": within(0.95, 1.1),
}


def evaluate_without_names(robot: Robot) -> Metrics:
    """Return the errors of one robot's map with barcodes and without, each the mean over SEEDS, and
    how many individuals the map has without them over the landmarks that the robot saw.
    """
    log = list(moments(robot))
    nameless = list(without_names(log))
    stamps_s = np.array([moment.stamp_s for moment in log])
    truth = Truth.at(robot, stamps_s)
    seen = {percept.label for moment in log for percept in moment.percepts}

    with_names = [follow(log, {}, ORIGIN, seed) for seed in SEEDS]
    without = [follow(nameless, {}, ORIGIN, seed) for seed in SEEDS]

    def error_m(drives: Iterable[Drive]) -> float:
        paths = [drive.corrected(stamps_s) for drive in drives]
        return float(np.mean([truth.aligned_error_m(path) for path in paths]))

    return {
        "slam_rmse_m": error_m(with_names),
        "without_names_rmse_m": error_m(without),
        "individuals": float(np.mean([drive.individuals for drive in without])),
        "landmarks_seen": float(len(seen)),
    }


def without_names(log: Iterable[Moment]) -> Iterator[Moment]:
    """Yield the moments with percepts that say where something stands, but not what it is."""
    for moment in log:
        nameless = [msgspec.structs.replace(each, name="", label="") for each in moment.percepts]
        yield replace(moment, percepts=nameless)


def summary(robots: Iterable[Robot], rows: Iterable[Metrics]) -> Metrics:
    """Return the means over the robots, and each robot's own."""
    of_each = list(rows)
    metrics = {key: float(np.mean([row[key] for row in of_each])) for key in of_each[0]}
    ratio = metrics["without_names_rmse_m"] / metrics["slam_rmse_m"]
    metrics["without_over_with_names"] = ratio
    metrics["individuals_over_landmarks"] = metrics["individuals"] / metrics["landmarks_seen"]

    for robot, row in zip(robots, of_each, strict=True):
        for key in ("slam_rmse_m", "without_names_rmse_m", "individuals", "landmarks_seen"):
            metrics[f"robot{robot.number}_{key}"] = row[key]
    return metrics
