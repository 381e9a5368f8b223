"""`python -m benchmarks learning`."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.learning import measure as learning
from benchmarks.options import announce, json_option, processes_option, report_metrics


@click.command(name="learning")
@processes_option
@json_option
def learning_command(processes: int, json_path: Path | None) -> None:
    """What is learned from what is conscious: names that are expected, and surprises.

    In held-out towns buildings are named from views in fog, with and without the names that their
    neighbours prime; what is ambiguous by itself counts. Then towns are explored, at the level of
    percepts, buildings torn down and streets closed: `expectation_share` of what could be noticed
    was conscious within three seconds. Takes ten minutes on two cores.
    """
    metrics = learning.measure(processes, announce)
    report_metrics("learning", learning.THRESHOLDS, metrics, json_path)
