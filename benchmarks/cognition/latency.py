"""The times from a view to the broadcast and to the action that it leads to, from a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.report import Metrics
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas.topics import ACTION, BROADCAST, Topic

MS = 1e6


def latencies(log: Path) -> Metrics:
    """The median times from a view to the broadcast and to the action that it leads to, and how
    many broadcasts a second there were. Of a log without any, NaN. Raises LogError.
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
    """The median age of the view that messages of a topic derive from, as they were sent."""
    ages_ms = []
    for record in records:
        if record.topic is topic and record.envelope is not None:
            ages_ms.append((record.envelope.sent_ns - record.envelope.born_ns) / MS)

    return float(np.median(ages_ms)) if ages_ms else float("nan")
