"""`python -m benchmarks lifelong`."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.lifelong import measure as lifelong
from benchmarks.options import json_option, report_metrics
from cogmap.cli.progress import bar


@click.command(name="lifelong")
@click.option(
    "--cycles",
    type=click.IntRange(lifelong.EARLY_AT + lifelong.SPAN, 10_000_000),
    default=lifelong.CYCLES,
    show_default=True,
    help="How many; the last thousand are compared with the third.",
)
@json_option
def lifelong_command(cycles: int, json_path: Path | None) -> None:
    """What a cycle costs after hours in one town over what it cost early, and what becomes of the
    map.

    One agent drives laps past the same places of a town, and to others, at the level of percepts;
    all modules in one process on the in-memory bus.
    """
    with bar("driving") as progress:
        metrics = lifelong.measure(progress, cycles=cycles)

    report_metrics("lifelong", lifelong.THRESHOLDS, metrics, json_path)
