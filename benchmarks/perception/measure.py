"""All bars of perception: two processes draw held-out towns and look at them; what that adds up to."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from functools import partial
from typing import Any

import numpy as np
from rich.progress import Progress

from benchmarks.perception import frames, sequence
from benchmarks.perception.looks import NOVEL, TRAINED, Look, Tick, novel_look, town_look
from benchmarks.perception.novel import Memory
from benchmarks.perception.objects import calibration_error, detection, named
from benchmarks.perception.road import road_edge_error_m
from benchmarks.perception.scenes import FARTHEST_M, FIRST_SEED, NEAREST_M
from benchmarks.threshold import at_least, at_most

THRESHOLDS = {
    "top1": at_least(0.97),
    "ece": at_most(0.05),
    "detect_recall": at_least(0.95),
    "detect_precision": at_least(0.95),
    "novel_top1": at_least(0.85),
    "road_iou": at_least(0.93),
    "road_edge_error_m": at_most(0.25),
    "depth_error": at_most(0.04),
    "sequence_recall_at_99p": at_least(0.80),
    "frame_ms_p50": at_most(60),
}
WORKERS = 2
# Of each town, up to how many of its kinds are invented.
TOWNS = (0, 0, 14, 0, 0, 14, 0, 0)
VIEWS = 90
NOVEL_TOWNS = 3
SIGHTINGS = 7
FRAMES = 150
RANGES_M = ((5.0, 15.0), (15.0, 30.0), (30.0, 60.0))
LARGER_SHARE = 0.03
POLL_S = 0.2


def measure() -> dict[str, float]:
    """Every figure of THRESHOLDS, and others that tell how it came about."""
    # Two processes, each on a core of its own: no library should start threads.
    os.environ.update(OMP_NUM_THREADS="1", LP_NUM_THREADS="1")
    seeds = range(FIRST_SEED, FIRST_SEED + len(TOWNS) + NOVEL_TOWNS)
    towns = [
        partial(town_look, seed, invented, VIEWS)
        for seed, invented in zip(seeds, TOWNS, strict=False)
    ]
    novel = [partial(novel_look, seed, SIGHTINGS) for seed in seeds[len(TOWNS) :]]
    spawning = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, spawning) as pool:
        try:
            # The longest first.
            ways, memories, looks = _looked(pool, [sequence.measure], novel, towns)
            places: dict[str, float] = ways[0]
            # The last has the machine to itself.
            times_ms = pool.submit(frames.took_ms, FIRST_SEED, FRAMES).result()
        finally:
            pool.shutdown(cancel_futures=True)
    return seen(looks) | known_again(memories) | places | frames.figures(times_ms)


def _looked(pool: ProcessPoolExecutor, *tasks: Sequence[Callable[[Tick], Any]]) -> list[list[Any]]:
    """What each of `tasks` gives back, which `pool` works at, with a bar of progress."""
    views = len(TOWNS) * VIEWS + NOVEL_TOWNS * NOVEL * (1 + SIGHTINGS) + sequence.views()
    with Progress() as progress, multiprocessing.Manager() as manager:
        ticks = manager.Queue()
        task = progress.add_task("views of held-out towns", total=views)
        running = [
            [pool.submit(each, partial(ticks.put, None)) for each in group] for group in tasks
        ]
        left = {future for group in running for future in group}
        while left:
            done, left = wait(left, POLL_S, FIRST_EXCEPTION)
            for future in done:
                future.result()
            progress.update(task, completed=ticks.qsize())
        progress.update(task, completed=views)
        return [[future.result() for future in group] for group in running]


def seen(looks: Sequence[Look]) -> dict[str, float]:
    """What was seen in all towns together."""
    sights = [sight for look in looks for sight in look.sights]
    names = named(sights, TRAINED, NEAREST_M, FARTHEST_M)
    found, there, right, said = detection(sights)
    found_large, there_large, _, _ = detection(sights, LARGER_SHARE)
    edges_missed_m = np.concatenate([look.edges_missed_m for look in looks])
    near = {
        f"top1_{least:g}_{most:g}m": _share(names)
        for least, most in RANGES_M
        for names in [named(sights, TRAINED, least, most)]
    }
    return {
        "top1": _share(names),
        "top1_segments": float(len(names)),
        **near,
        "ece": calibration_error([pair for look in looks for pair in look.judged]),
        "detect_recall": found / max(1, there),
        "detect_precision": right / max(1, said),
        "detect_buildings": float(there),
        "detect_segments": float(said),
        "detect_recall_3_percent": found_large / max(1, there_large),
        "road_iou": float(np.mean([look.road_iou for look in looks])),
        "road_edge_error_m": road_edge_error_m([look.edge_errors_m for look in looks]),
        "road_edge_missed_m": road_edge_error_m([edges_missed_m]),
        "depth_error": float(np.median(np.concatenate([look.depth_errors for look in looks]))),
        "depth_known": float(np.mean([look.depth_known for look in looks])),
    }


def known_again(memories: Sequence[Memory]) -> dict[str, float]:
    """What became of the buildings that were met once, in all towns together."""
    sightings = sum(memory.later for memory in memories)
    return {
        "novel_top1": sum(memory.right for memory in memories) / max(1, sightings),
        "novel_buildings": float(sum(memory.met for memory in memories)),
        "novel_sightings": float(sightings),
        "novel_wrong_merges": float(sum(memory.merges for memory in memories)),
        "novel_splits": float(sum(memory.splits for memory in memories)),
        "novel_as_trained": float(sum(memory.mistaken for memory in memories)),
    }


def _share(right: Sequence[bool]) -> float:
    return sum(right) / max(1, len(right))
