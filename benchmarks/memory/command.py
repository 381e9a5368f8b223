"""`python -m benchmarks memory`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from benchmarks.memory import measure as memory
from benchmarks.options import announce, json_option, processes_option, report_metrics


@click.command(name="memory")
@processes_option
@json_option
def memory_command(processes: int, json_path: Path | None) -> None:
    """Long-term memory: recall from corrupted cues, a second run in a town, kills and damage.

    Sparse distributed memory is read with 30 % of each cue's dimensions at random, and timed beside
    a loop over its locations; episodes are recalled from a part of them, and maps between equal
    houses by what was passed. In ten towns a robot explores, and begins anew elsewhere with the map
    in memory, and with those of the nine other towns. Writers are killed, and databases cut short
    or flipped: `damaged_store_refused` counts those that were not refused. Takes a quarter of an
    hour on two cores.
    """
    with tempfile.TemporaryDirectory() as folder:
        metrics = memory.measure(Path(folder), processes, announce)

    report_metrics("memory", memory.THRESHOLDS, metrics, json_path)
