"""`python -m benchmarks cognition`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from benchmarks.cognition import measure as cognition
from benchmarks.options import announce, json_option, processes_option, report_metrics


@click.command(name="cognition")
@processes_option
@json_option
def cognition_command(processes: int, json_path: Path | None) -> None:
    """How fast something is conscious and acted on, whether the agent keeps its energy, and whether
    it finds its way by guidance.

    Drives a lap of the demo's town in real time, every module a process. Then an agent lives in ten
    towns for ten minutes, with percept-level sensing and a battery that lasts for three as it
    drives, and one beside it that acts at random; in the first town also with cameras, which is
    reported beside. Ten routes in other towns are driven once, and again by the guidance schemes
    that were learned. Takes half an hour on two cores.
    """
    with tempfile.TemporaryDirectory() as folder:
        metrics = cognition.measure(Path(folder), processes, announce)

    report_metrics("cognition", cognition.THRESHOLDS, metrics, json_path)
