"""The command `python -m benchmarks planning`."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.options import json_option, report_metrics
from benchmarks.planning import grid
from benchmarks.report import Metrics


@click.command(name="planning")
@click.option(
    "--grid",
    "map_path",
    type=click.Path(path_type=Path),
    metavar="MAP",
    help="A grid map of yours in the MovingAI format (.map), packed with xz or not.",
)
@click.option(
    "--scen",
    "scenario_path",
    type=click.Path(path_type=Path),
    metavar="SCEN",
    help="Of --grid: the problems on it (.scen), packed with xz or not.",
)
@json_option
def planning_command(
    map_path: Path | None, scenario_path: Path | None, json_path: Path | None
) -> None:
    """How short routes are, and how fast they are found: flat, and on a hierarchy of maps.

    With --grid and --scen: every problem of the scenario, on all places of the map and on the
    hierarchy, against the optimal lengths that the scenario states, and against Dijkstra's method
    as scipy has it, on the same graph from the same goal. Takes about half a minute.

    \b
    python -m benchmarks planning --grid Berlin_0_256.map --scen Berlin_0_256.map.scen
    """
    if (map_path is None) != (scenario_path is None):
        raise click.UsageError("--grid and --scen belong together: give both")

    metrics: Metrics = {}
    if map_path is not None and scenario_path is not None:
        metrics |= grid.measure(map_path, scenario_path)
    if not metrics:
        raise click.UsageError("there is nothing to plan on: give --grid and --scen")

    report_metrics("planning", grid.THRESHOLDS, metrics, json_path)
