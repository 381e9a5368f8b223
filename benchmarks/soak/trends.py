"""What grew during a long run, by samples of its processes and the times of its cycles. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats

WARM_UP_SHARE = 0.25
"""Of a run: until then the first laps are learned, and caches fill."""

WINDOW_SHARE = 0.15
"""Of the time after the warm-up: the windows at its begin and its end, which are compared."""

MIN_SAMPLES = 3
S_PER_H = 3600.0


@dataclass(frozen=True)
class Sample:
    """One process at `at_s` of the run: its resident memory and its open descriptors."""

    at_s: float
    memory_bytes: int
    descriptors: int


@dataclass(frozen=True)
class Span:
    """The time of a run that is judged, in s from its begin: from the end of its warm-up on."""

    begin_s: float
    end_s: float

    @classmethod
    def after_warm_up(cls, run_s: float) -> Span:
        """Make the span of a run of so long."""
        return cls(WARM_UP_SHARE * run_s, run_s)

    @property
    def window_s(self) -> float:
        """Return how long each of the two windows is."""
        return WINDOW_SHARE * (self.end_s - self.begin_s)

    def first(self, at_s: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which of the (n,) times lie in the first window."""
        return (at_s >= self.begin_s) & (at_s < self.begin_s + self.window_s)

    def last(self, at_s: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which of the (n,) times lie in the last window."""
        return (at_s > self.end_s - self.window_s) & (at_s <= self.end_s)


def slope_mb_per_h(samples: Sequence[Sample], span: Span) -> float:
    """Fit a line to the memory in `span` by least squares, and return its slope; NaN of fewer than
    MIN_SAMPLES.
    """
    judged = [each for each in samples if span.begin_s <= each.at_s <= span.end_s]
    if len(judged) < MIN_SAMPLES:
        return math.nan

    hours = np.array([each.at_s for each in judged]) / S_PER_H
    memory_mb = np.array([each.memory_bytes for each in judged]) / 1e6
    centred_h = hours - hours.mean()
    return float(centred_h @ memory_mb / (centred_h @ centred_h))


def descriptors_growth(samples: Sequence[Sample], span: Span) -> float:
    """Return the median of the open descriptors in the last window, less that of the first; NaN
    where one has no sample.
    """
    at_s = np.array([each.at_s for each in samples])
    counts = np.array([each.descriptors for each in samples], dtype=float)
    return _median(counts[span.last(at_s)]) - _median(counts[span.first(at_s)])


def cycle_p50_ms(at_s: Floats, cycle_ms: Floats, span: Span) -> tuple[float, float]:
    """Return the medians of the (n,) cycle times, which ended at `at_s`, in the first and the last
    window; NaN for one that has none.
    """
    return _median(cycle_ms[span.first(at_s)]), _median(cycle_ms[span.last(at_s)])


def _median(values: Floats) -> float:
    return float(np.median(values)) if values.size else math.nan


@dataclass(frozen=True)
class Sizes:
    """The files of a run at `at_s`: bytes of all parts of its log, of each journal by name, and of
    long-term memory.
    """

    at_s: float
    log_bytes: int
    journal_bytes: Mapping[str, int]
    memory_bytes: int


def is_log_bounded(sizes: Sequence[Sizes], limit_bytes: float) -> bool:
    """Decide whether the log was never longer than its parts may be together."""
    return all(each.log_bytes <= limit_bytes for each in sizes)


def is_journal_bounded(sizes: Sequence[Sizes], limit_bytes: float) -> bool:
    """Decide whether each journal stayed below `limit_bytes`, or was compacted each time when it
    had grown to more: it ends below four times what it was compacted to last.
    """
    names = {name for each in sizes for name in each.journal_bytes}
    return all(_is_compacted(_of(name, sizes), limit_bytes) for name in names)


def compactions(sizes: Sequence[Sizes]) -> int:
    """Count how often a journal became shorter."""
    names = {name for each in sizes for name in each.journal_bytes}
    found = 0
    for name in names:
        steps = np.diff(_of(name, sizes))
        found += int((steps < 0).sum())

    return found


def _of(name: str, sizes: Sequence[Sizes]) -> Floats:
    """Return the (n,) sizes of one journal."""
    return np.array([each.journal_bytes.get(name, 0) for each in sizes], dtype=float)


def _is_compacted(journal_bytes: Floats, limit_bytes: float) -> bool:
    if journal_bytes.max() <= limit_bytes:
        return True

    shortened = np.flatnonzero(np.diff(journal_bytes) < 0)
    if not shortened.size:
        return False
    least = journal_bytes[shortened + 1].max()
    return bool(journal_bytes.max() <= max(limit_bytes, GROWTH * least))


GROWTH = 4.0
"""A journal is compacted again once it is so many times as long as after it was compacted last."""
