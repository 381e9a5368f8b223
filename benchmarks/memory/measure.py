"""The metrics of memory: recall from corrupted cues, its speed, recall of episodes, and of maps
between equal houses, a second run in a town, and what kills and damage do to the database.
"""

from __future__ import annotations

from benchmarks.benchmark import Setting
from benchmarks.memory import durability, episodes, equal_houses, recall, second_run, speed
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most

SEED = 1
STORES = 200
KILLS = 50
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


def measure(setting: Setting) -> Metrics:
    """Measure long-term memory: recall from corrupted cues, a second run in a town, kills and
    damage.

    Sparse distributed memory is read with 30 % of each cue's dimensions at random, and timed beside
    a loop over its locations; episodes are recalled from a part of them, and maps between equal
    houses by the houses passed. In ten towns a robot explores, and begins anew elsewhere with the
    map in memory, and with those of the nine other towns. Writers are killed, and databases cut
    short or flipped: `damaged_store_refused` counts those that were not refused although they had
    changed. Takes three quarters of an hour on two cores.
    """
    announce = setting.announce
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
    folder = setting.folder
    metrics["damaged_store_refused"] = float(durability.open_damaged(folder, STORES).changed)
    metrics["lost_after_kill"] = float(durability.kill_writers(folder, KILLS).lost)

    announce("first and second runs in towns")
    return metrics | second_run.measure(setting.processes)
