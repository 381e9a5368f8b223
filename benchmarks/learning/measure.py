"""The metrics of learning from what is conscious: expected names, and surprises."""

from __future__ import annotations

from benchmarks.benchmark import Setting
from benchmarks.learning import expectation, priming
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, more_than

THRESHOLDS = {
    "priming_gain": more_than(0),
    "expectation_share": at_least(0.9),
}


def measure(setting: Setting) -> Metrics:
    """Measure learning from what is conscious: names that are expected, and surprises.

    In held-out towns buildings are named from views in fog, with and without the names that their
    neighbours prime; views that are ambiguous by themselves count. Then towns are explored, at the
    level of percepts, buildings torn down and streets closed: `expectation_share` of what could be
    noticed was conscious within three seconds. Takes ten minutes on two cores.
    """
    setting.announce(f"naming buildings in {priming.TOWNS} towns")
    named = priming.measure(setting.processes)

    setting.announce(f"exploring {expectation.TOWNS} towns that then change")
    return named | expectation.measure(setting.processes)
