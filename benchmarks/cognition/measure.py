"""The metrics of cognition: how fast something is conscious and acted on, and whether the agent
lives by it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.benchmark import Setting
from benchmarks.cognition.guided import ROUTES, guidance
from benchmarks.cognition.life import Life, live
from benchmarks.cognition.random_actions import RandomActions
from benchmarks.drive import drive
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most, within
from cogmap.cli.progress import bar
from cogmap.parallel import parallel_map
from cogmap.recording.storage.format import LOG_NAME
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas.topics import ACTION, BROADCAST, Topic

TOWNS = 10
FIRST_SEED = 101
LIFE_S = 600.0
THRESHOLDS = {
    "cycle_ms_p50": at_most(130),
    "broadcasts_per_s": within(3, 10),
    "conscious_latency_ms_p50": at_most(200),
    "survived_share": at_least(1),
    "lowest_energy": at_least(0.15),
    "guided_share": at_least(0.9),
}


@dataclass(frozen=True)
class Stay:
    """A life in a town, by its seed, acting at random or not, with cameras or at the level of
    percepts.
    """

    seed: int
    at_random: bool = False
    has_cameras: bool = False


def measure(setting: Setting) -> Metrics:
    """Measure how fast something is conscious and acted on, whether the agent keeps its energy, and
    whether it finds its way by guidance.

    Drives a lap of the demo's town in real time, every module a process. Then an agent lives in ten
    towns for ten minutes, with percept-level sensing and a battery that lasts for three as it
    drives, and one beside it that acts at random; in the first town also with cameras, which is
    reported beside. Ten routes in other towns are driven once, and again by the guidance schemes
    that were learned. Takes half an hour on two cores.
    """
    setting.announce("driving one lap in real time")
    drive(setting.folder)
    metrics = latencies(setting.folder / LOG_NAME)

    setting.announce(f"living in {TOWNS} towns for {LIFE_S:g} s each, twice")
    metrics |= survival(setting.processes)

    setting.announce(f"driving {ROUTES} routes twice, the second time by guidance")
    return metrics | guidance(setting.processes)


def survival(processes: int, towns: int = TOWNS) -> Metrics:
    """Measure the shares of towns in which an agent's energy never runs out, acting by itself and
    at random, and its life in the first town with cameras.
    """
    stays = [Stay(FIRST_SEED, has_cameras=True)]
    for seed in range(FIRST_SEED, FIRST_SEED + towns):
        stays += [Stay(seed), Stay(seed, at_random=True)]

    with bar("lives") as progress:
        with_cameras, *lives = parallel_map(lived, stays, processes, progress)

    own = lives[::2]
    return {
        "survived_share": _survived(own),
        "random_survived_share": _survived(lives[1::2]),
        "lowest_energy": min(life.lowest for life in own),
        "charged_mean": float(np.mean([life.charged for life in own])),
        "cameras_lived_s": with_cameras.lived_s,
        "cameras_lowest_energy": with_cameras.lowest,
        "cameras_charged": float(with_cameras.charged),
    }


def lived(stay: Stay) -> Life:
    """Let an agent live in a town."""
    if stay.at_random:
        return live(stay.seed, LIFE_S, acting=RandomActions(stay.seed).module())
    return live(stay.seed, LIFE_S, has_cameras=stay.has_cameras)


def _survived(lives: list[Life]) -> float:
    return float(np.mean([not life.ran_out for life in lives]))


def latencies(log: Path) -> Metrics:
    """Measure the median times from a view to the broadcast and to the action that it leads to, and
    how many broadcasts a second there were. They are NaN if a log has none. Raises LogError.
    """
    records = list(LogReader(log).records([BROADCAST, ACTION]))
    broadcasts = [record for record in records if record.topic is BROADCAST]
    times_s = np.array([record.log_time_ns for record in broadcasts]) / 1e9
    lasted_s = float(np.ptp(times_s)) if len(times_s) > 1 else np.nan

    return {
        "cycle_ms_p50": _median_ms(records, ACTION),
        "conscious_latency_ms_p50": _median_ms(records, BROADCAST),
        "broadcasts_per_s": (len(times_s) - 1) / lasted_s,
    }


def _median_ms(records: list[Record], topic: Topic) -> float:
    """Return the median age of the view that messages of a topic derive from, as they were sent."""
    ages_ms = []
    for record in records:
        if record.topic is topic and record.envelope is not None:
            ages_ms.append((record.envelope.sent_ns - record.envelope.born_ns) / 1e6)

    return float(np.median(ages_ms)) if ages_ms else float("nan")
