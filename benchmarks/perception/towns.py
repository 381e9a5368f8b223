"""The metrics of perception in held-out towns, which processes draw and look at."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.perception import frames, sequence
from benchmarks.perception.looks import TRAINED, Look, novel_look, town_look
from benchmarks.perception.novel import Memory
from benchmarks.perception.objects import Sight, calibration_error, detection, named
from benchmarks.perception.road import road_edge_error_m
from benchmarks.perception.scenes import FARTHEST_M, FIRST_SEED, NEAREST_M
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.parallel import parallel_map

THRESHOLDS = {
    "top1": at_least(0.97),
    "ece": at_most(0.05),
    "detect_recall": at_least(0.95),
    "detect_precision": at_least(0.95),
    "novel_top1": at_least(0.85),
    "novel_wrong_merges": at_most(0.02),
    "road_iou": at_least(0.93),
    "road_edge_error_m": at_most(0.25),
    "depth_error": at_most(0.04),
    "sequence_recall_at_99p": at_least(0.80),
    "frame_ms_p50": at_most(40),
    "frame_ms_p99": at_most(60),
}
PROCESSES = 2
# Of each town, up to how many of its kinds are invented.
TOWNS = (0, 0, 14, 0, 0, 14, 0, 0)
VIEWS = 90
NOVEL_TOWNS = 3
SIGHTINGS = 7
FRAMES = 150
RANGES_M = ((5.0, 15.0), (15.0, 30.0), (30.0, 60.0))
LARGER_SHARE = 0.03


def measure() -> Metrics:
    """The metrics of THRESHOLDS, and others that explain them."""
    # Each process is on a core of its own: no library should start threads.
    os.environ.update(OMP_NUM_THREADS="1", LP_NUM_THREADS="1")

    with bar("held-out towns") as progress:
        found = parallel_map(_run, _jobs(), PROCESSES, progress)

    places: Metrics = found[0]
    memories = found[1 : 1 + NOVEL_TOWNS]
    looks = found[1 + NOVEL_TOWNS :]
    times_ms = frames.times_ms(FIRST_SEED, FRAMES)
    return places | seen(looks) | recognised_again(memories) | frames.metrics(times_ms)


def _jobs() -> list[Callable[[], Any]]:
    """Places by sequence, the towns of novel buildings, and TOWNS: the longest come first."""
    jobs: list[Callable[[], Any]] = [sequence.measure]

    first_novel = FIRST_SEED + len(TOWNS)
    for number in range(NOVEL_TOWNS):
        jobs.append(partial(novel_look, first_novel + number, SIGHTINGS))

    for seed, invented in enumerate(TOWNS, start=FIRST_SEED):
        jobs.append(partial(town_look, seed, invented, VIEWS))

    return jobs


def _run(job: Callable[[], Any]) -> Any:
    return job()


def seen(looks: Sequence[Look]) -> Metrics:
    """What was seen in all towns together."""
    sights: list[Sight] = []
    judged: list[tuple[float, bool]] = []
    for look in looks:
        sights += look.sights
        judged += look.judged

    metrics = _named(sights) | {"ece": calibration_error(judged)} | _detected(sights)
    return metrics | _road(looks) | _depth(looks)


def _road(looks: Sequence[Look]) -> Metrics:
    iou = [look.road_iou for look in looks]
    edge_errors_m = [look.edge_errors_m for look in looks]
    edges_missed_m = [look.edges_missed_m for look in looks]

    return {
        "road_iou": float(np.mean(iou)),
        "road_edge_error_m": road_edge_error_m(edge_errors_m),
        "road_edge_missed_m": road_edge_error_m(edges_missed_m),
    }


def _depth(looks: Sequence[Look]) -> Metrics:
    errors = np.concatenate([look.depth_errors for look in looks])
    known = [look.depth_known for look in looks]

    return {
        "depth_error": float(np.median(errors)),
        "depth_known": float(np.mean(known)),
    }


def _named(sights: Sequence[Sight]) -> Metrics:
    """The share of segments of trained kinds whose name is right, in all and by distance."""
    right = named(sights, TRAINED, NEAREST_M, FARTHEST_M)
    metrics = {
        "top1": _share(right),
        "top1_segments": float(len(right)),
    }

    for min_m, max_m in RANGES_M:
        right_there = named(sights, TRAINED, min_m, max_m)
        metrics[f"top1_{min_m:g}_{max_m:g}m"] = _share(right_there)

    return metrics


def _detected(sights: Sequence[Sight]) -> Metrics:
    found, there, right, claimed = detection(sights)
    found_large, there_large, _, _ = detection(sights, LARGER_SHARE)

    return {
        "detect_recall": found / max(1, there),
        "detect_precision": right / max(1, claimed),
        "detect_buildings": float(there),
        "detect_segments": float(claimed),
        "detect_recall_3_percent": found_large / max(1, there_large),
    }


def recognised_again(memories: Sequence[Memory]) -> Metrics:
    """What became of the buildings that were met once, in all towns together; wrong merges as a
    share of the later sightings.
    """
    together = sum(memories, Memory())
    later = max(1, together.later)

    return {
        "novel_top1": together.right / later,
        "novel_buildings": float(together.met),
        "novel_sightings": float(together.later),
        "novel_wrong_merges": together.merges / later,
        "novel_splits": float(together.splits),
        "novel_as_trained": float(together.mistaken),
    }


def _share(right: Sequence[bool]) -> float:
    count = max(1, len(right))
    return sum(right) / count
