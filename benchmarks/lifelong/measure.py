"""The cost of a cycle after days of driving over its cost early, and the error of the map."""

from __future__ import annotations

import gc

import click
import numpy as np
import psutil
from scipy.spatial import KDTree

from benchmarks.benchmark import Setting
from benchmarks.harness import COGNITION, CycleMeter, build, running, town_sections
from benchmarks.lifelong.courier import Courier
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.cli.launch.observer import Observer
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError
from cogmap.graph.graph import Graph
from cogmap.parallel import Progress
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.nodes import Object

SEED = 3201
CYCLES = 20_000
SPAN = 1_000
EARLY_AT = 3_000
CYCLES_PER_S = 5
MIN_LAPS = 2
OBSERVED = (topics.TRUE_TOWN, topics.TRUE_POSE, topics.DELTA)

THRESHOLDS = {
    "cycle_ratio": at_most(1.3),
    "log_bytes_ratio": at_most(1.3),
    "memory_ratio": at_most(1.3),
    "map_error_ratio": at_most(1.0),
}
OPTIONS = (
    click.Option(
        ["--cycles"],
        type=click.IntRange(EARLY_AT + SPAN, 10_000_000),
        default=CYCLES,
        show_default=True,
        help="How many; the last thousand are compared with the third.",
    ),
)


def measure(setting: Setting, *, cycles: int = CYCLES) -> Metrics:
    """Measure the cost of a cycle after hours in one town over its cost early, and the error of the
    map.

    One agent drives laps past the same places of a town, and to others, at the level of percepts;
    all modules in one process on the in-memory bus.
    """
    with bar("driving") as progress:
        return drive(cycles, progress)


def drive(cycles: int, progress: Progress, early_at: int = EARLY_AT, seed: int = SEED) -> Metrics:
    """Return the metrics of so many cycles in one town. Raises CogmapError if a module rejected a
    message, or the drive ended before.
    """
    sections = town_sections(seed)
    # Longer than the cycles take, at five a second.
    sections["sim"]["duration_s"] = 2.0 * cycles / CYCLES_PER_S

    courier = Courier(seed)
    observer = Observer()
    watching = Module("observer")
    for topic in OBSERVED:
        watching.on(topic, observer.update)

    meter = CycleMeter()
    early_bytes = 0
    early_error_m = float("nan")

    def is_over() -> bool:
        """Note what is due by now: the map after the second lap, memory after `early_at`."""
        nonlocal early_bytes, early_error_m
        if np.isnan(early_error_m) and courier.laps >= MIN_LAPS:
            early_error_m = map_error_m(courier.graph, observer)
        if not early_bytes and meter.cycles >= early_at:
            early_bytes = resident_bytes()

        progress(meter.cycles / cycles)
        return meter.cycles >= cycles

    modules = build(("sim", *COGNITION), sections)
    with running([*modules, courier.module("courier", [topics.OFFER]), watching]) as runner:
        meter.listen(runner, topics.ALL)
        runner.run(is_over)
        late_bytes = resident_bytes()

    if meter.cycles < cycles:
        raise CogmapError(f"the drive ended after {meter.cycles} of {cycles} cycles")

    early_s, early_log_bytes = meter.spent(max(0, early_at - SPAN), early_at)
    late_s, late_log_bytes = meter.spent(max(0, cycles - SPAN), cycles)
    error_m = map_error_m(courier.graph, observer)
    return {
        "cycle_ratio": late_s / early_s,
        "log_bytes_ratio": late_log_bytes / early_log_bytes,
        "memory_ratio": late_bytes / early_bytes,
        "map_error_ratio": error_m / early_error_m,
        "cycle_cpu_ms_early": early_s * 1e3,
        "cycle_cpu_ms_late": late_s * 1e3,
        "log_bytes_early": early_log_bytes,
        "log_bytes_late": late_log_bytes,
        "memory_mb_late": late_bytes / 1e6,
        "map_error_m_late": error_m,
        "laps": float(courier.laps),
        "travelled_m": observer.travelled_m,
    }


def map_error_m(graph: Graph, observer: Observer) -> float:
    """Return the mean distance of the objects of a map from the nearest building of any name; NaN
    of none.
    """
    learned_m = [(node.x_m, node.y_m) for node in graph.of_kind(Object)]
    if observer.town is None or not learned_m:
        return float("nan")

    built_m = [(building.pose.x_m, building.pose.y_m) for building in observer.town.buildings]
    away_m, _ = KDTree(built_m).query(observer.to_world(np.array(learned_m)))
    return float(np.mean(away_m))


def resident_bytes() -> int:
    """Return the memory of this process, with all modules in it."""
    gc.collect()
    return int(psutil.Process().memory_info().rss)
