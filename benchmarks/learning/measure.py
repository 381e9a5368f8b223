"""The metrics of learning from what is conscious: expected names, and surprises."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.learning import expectation, priming
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, more_than

THRESHOLDS = {
    "priming_gain": more_than(0),
    "expectation_share": at_least(0.9),
}


def measure(processes: int, announce: Callable[[str], None]) -> Metrics:
    """The metrics of THRESHOLDS, and what they are made of."""
    announce(f"naming buildings in {priming.TOWNS} towns")
    named = priming.measure(processes)

    announce(f"exploring {expectation.TOWNS} towns that then change")
    return named | expectation.measure(processes)
