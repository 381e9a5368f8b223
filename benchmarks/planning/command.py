"""The command `python -m benchmarks planning`."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.options import json_option, processes_option, report_metrics
from benchmarks.planning import grid, tours
from benchmarks.report import Metrics
from cogmap.cli.progress import bar


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
@click.option(
    "--tsp",
    "tsp_folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="TSPLIB problems of yours (.tsp: EUC_2D, ATT, GEO), packed with xz or not; NAME.opt.tour "
    "is taken for the optimum where it is there.",
)
@click.option(
    "--human-tours",
    "human_folder",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="People's tours: problems as GraphN.lib, in TSPLIB's format, and tours.csv, packed with "
    "xz or not.",
)
@processes_option
@json_option
def planning_command(
    *,
    map_path: Path | None,
    scenario_path: Path | None,
    tsp_folder: Path | None,
    human_folder: Path | None,
    processes: int,
    json_path: Path | None,
) -> None:
    """How short routes are, and how fast they are found: flat, and on a hierarchy of maps.

    With --grid and --scen: every problem of the scenario, on all places of the map and on the
    hierarchy, against the optimal lengths that the scenario states, and against Dijkstra's method
    as scipy has it, on the same graph from the same goal. Takes about half a minute.

    With --tsp: tours past all cities of the problems with 50 to 80 cities, against the optimum,
    which is computed exactly where the folder does not give it. Takes up to a minute a problem.

    With --human-tours: by how much tours of simulated participants are longer than the shortest,
    against those of people on the same problems. Takes about half a minute.

    \b
    python -m benchmarks planning --grid Berlin_0_256.map --scen Berlin_0_256.map.scen
    python -m benchmarks planning --tsp tsplib --human-tours human_tsp
    """
    if (map_path is None) != (scenario_path is None):
        raise click.UsageError("--grid and --scen belong together: give both")

    metrics: Metrics = {}
    if map_path is not None and scenario_path is not None:
        metrics |= grid.measure(map_path, scenario_path)
    if tsp_folder is not None:
        with bar("planning tours") as progress:
            metrics |= tours.measure_tsp(tsp_folder, processes, progress)
    if human_folder is not None:
        with bar("planning people's problems") as progress:
            metrics |= tours.measure_human(human_folder, processes, progress)
    if not metrics:
        raise click.UsageError(
            "there is nothing to plan on: give --grid and --scen, --tsp or --human-tours"
        )

    report_metrics("planning", grid.THRESHOLDS | tours.THRESHOLDS, metrics, json_path)
