"""What a cycle costs after days of driving over what it cost early, and what became of the map."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from typing import NamedTuple

import click
import numpy as np
import psutil
from scipy.spatial import KDTree

from benchmarks.benchmark import Setting
from benchmarks.explore.measure import COGNITION, sections
from benchmarks.lifelong.courier import Courier
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.cli.launch.metrics import objects, position_m
from cogmap.cli.launch.observer import Observer
from cogmap.cli.log.progress import bar
from cogmap.errors import CogmapError
from cogmap.parallel import Progress
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.services import registry

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


class Mark(NamedTuple):
    """What had been spent by the end of a cycle."""

    cpu_s: float
    log_bytes: int


class Meter:
    """Notes what all modules had spent at the end of each cycle, which is the command's."""

    def __init__(self) -> None:
        self.marks = [Mark(time.process_time(), 0)]
        self._log_bytes = 0

    @property
    def cycles(self) -> int:
        """How many cycles have ended."""
        return len(self.marks) - 1

    def listen(self, bus: MemoryBus) -> None:
        """Subscribe to every topic, as the recorder does."""
        for topic in topics.ALL:
            bus.subscribe(topic, self._on_message, _ignore_gap)
        bus.subscribe(topics.MOTOR_COMMAND, self._on_command, _ignore_gap)

    def spent(self, last: int) -> tuple[float, float]:
        """The mean CPU time, in s, and bytes of messages of the SPAN cycles up to `last`."""
        before = self.marks[max(0, last - SPAN)]
        after = self.marks[last]
        cycles = last - max(0, last - SPAN)
        return (after.cpu_s - before.cpu_s) / cycles, (after.log_bytes - before.log_bytes) / cycles

    def _on_message(self, arrival: Arrival) -> None:
        self._log_bytes += len(arrival.payload)

    def _on_command(self, arrival: Arrival) -> None:
        self.marks.append(Mark(time.process_time(), self._log_bytes))


def _ignore_gap(source: str, count: int) -> None:
    """The bus in memory loses nothing."""


class _Days:
    """One drive, looked at from outside: its map after the second lap, memory after EARLY_AT."""

    def __init__(self, seed: int, early_at: int) -> None:
        self.meter = Meter()
        self.courier = Courier(seed)
        self.observer = Observer()
        self.early_error_m = float("nan")
        self.early_bytes = 0
        self._early_at = early_at

    def module(self) -> Module:
        """The module that observes."""
        module = Module("observer")
        for topic in OBSERVED:
            module = module.on(topic, self.observer.update)
        return module

    def look(self) -> None:
        """Note what is due by now."""
        if np.isnan(self.early_error_m) and self.courier.laps >= MIN_LAPS:
            self.early_error_m = self.error_m
        if not self.early_bytes and self.meter.cycles >= self._early_at:
            self.early_bytes = _resident_bytes()

    @property
    def error_m(self) -> float:
        """How far the objects of the map are from the nearest building on average, whatever name
        they have.
        """
        town = self.observer.town
        learned = [position_m(each) for each in objects(self.courier.graph)]
        if town is None or not learned:
            return float("nan")

        built_m = [(building.pose.x_m, building.pose.y_m) for building in town.buildings]
        away_m, _ = KDTree(built_m).query(self.observer.to_world(np.array(learned)))
        return float(np.mean(away_m))


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
    days = _Days(seed, early_at)
    configured = _sections(seed, cycles)
    modules = [registry.build(name, configured) for name in ("sim", *COGNITION)]
    with InProcessRunner([*modules, days.courier.module(), days.module()]) as runner:
        days.meter.listen(MemoryBus(runner.network))
        runner.run(_until(days, cycles, progress))
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")

        late_bytes = _resident_bytes()

    if days.meter.cycles < cycles:
        raise CogmapError(f"the drive ended after {days.meter.cycles} of {cycles} cycles")
    return _metrics(days, cycles, early_at, late_bytes)


def _metrics(days: _Days, cycles: int, early_at: int, late_bytes: int) -> Metrics:
    early_s, early_log_bytes = days.meter.spent(early_at)
    late_s, late_log_bytes = days.meter.spent(cycles)
    return {
        "cycle_ratio": late_s / early_s,
        "log_bytes_ratio": late_log_bytes / early_log_bytes,
        "memory_ratio": late_bytes / days.early_bytes,
        "map_error_ratio": days.error_m / days.early_error_m,
        "cycle_cpu_ms_early": early_s * 1e3,
        "cycle_cpu_ms_late": late_s * 1e3,
        "log_bytes_early": early_log_bytes,
        "log_bytes_late": late_log_bytes,
        "memory_mb_late": late_bytes / 1e6,
        "map_error_m_late": days.error_m,
        "laps": float(days.courier.laps),
        "travelled_m": days.observer.travelled_m,
    }


def _until(days: _Days, cycles: int, progress: Progress) -> Callable[[], bool]:
    def has_ended() -> bool:
        days.look()
        progress(days.meter.cycles / cycles)
        return days.meter.cycles >= cycles

    return has_ended


def _sections(seed: int, cycles: int) -> Sections:
    """The town of exploration, driven through without exploring for longer than `cycles`."""
    configured = sections(seed)
    configured["sim"] = configured["sim"] | {"duration_s": 2.0 * cycles / CYCLES_PER_S}
    return configured


def _resident_bytes() -> int:
    """The memory of this process, with all modules in it."""
    gc.collect()
    return int(psutil.Process().memory_info().rss)
