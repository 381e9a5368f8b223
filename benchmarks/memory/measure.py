"""The metrics of memory: recall from corrupted cues, its speed, recall of episodes, and of maps
between equal houses, a second run in a town, and what kills and damage do to the database.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.memory import durability, episodes, equal_houses, recall, second_run, speed
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most

SEED = 1
THRESHOLDS = {
    "recall_corrupted_30": at_least(0.99),
    "reads_vs_numpy_loop": at_least(20),
    "episodes_recalled": at_least(0.9),
    "wrong_episodes": at_most(0.05),
    "equal_houses_wrong": at_most(0),
    "second_run_share": at_most(0.2),
    "wrong_recalls": at_most(0),
    "lost_after_kill": at_most(0),
    "damaged_store_refused": at_most(0),
}


def measure(folder: Path, processes: int, announce: Callable[[str], None]) -> Metrics:
    """Every metric of THRESHOLDS; `folder` is for databases. `damaged_store_refused` counts the
    damaged databases that were not refused although they had changed.
    """
    announce("recall from corrupted cues")
    metrics: Metrics = {
        "recall_corrupted_30": recall.recall_corrupted(SEED),
        "reads_vs_numpy_loop": speed.reads_vs_numpy_loop(SEED),
    }

    announce("recall of episodes")
    metrics |= episodes.measure(SEED)

    announce("recall of maps between equal houses")
    metrics |= equal_houses.measure(SEED)

    announce("databases that are cut or flipped, and writers that are killed")
    metrics["damaged_store_refused"] = float(durability.damaged_store_opened(folder))
    metrics["lost_after_kill"] = float(durability.lost_after_kill(folder))

    announce("first and second runs in towns")
    return metrics | second_run.measure(processes)
