"""`python -m benchmarks explore`."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.explore import measure as explore
from benchmarks.options import json_option, processes_option, report_metrics
from cogmap.cli.progress import bar


@click.command(name="explore")
@click.option(
    "--towns",
    type=click.IntRange(1, 1000),
    default=explore.TOWNS,
    show_default=True,
    help="How many; the metrics are of all.",
)
@processes_option
@json_option
def explore_command(towns: int, processes: int, json_path: Path | None) -> None:
    """How much of a town an agent explores by itself in 15 minutes, and how well it then finds its
    goals.

    Towns of several blocks at the level of percepts, the modules on the in-memory bus. Then ten
    goals a town, half of them with a street of the planned route closed on the way. The first town
    is also explored with cameras; its figures are beside the others, with `cameras` before them.
    Takes three quarters of an hour on two cores.
    """
    with bar("exploring") as progress:
        metrics = explore.measure(processes, progress, towns=towns)

    report_metrics("explore", explore.THRESHOLDS, metrics, json_path)
