"""The metrics of planning: routes over a grid map, and tours."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.planning import grid, tours
from benchmarks.report import Metrics

OPTIONS = (
    path_option(
        "--grid",
        "map_path",
        metavar="MAP",
        text="A grid map of yours in the MovingAI format (.map), packed or not.",
    ),
    path_option(
        "--scen",
        "scenario_path",
        metavar="SCEN",
        text="Of --grid: the problems on it (.scen), packed or not.",
    ),
    path_option(
        "--tsp",
        "tsp_folder",
        metavar="DIR",
        text="TSPLIB problems of yours (.tsp: EUC_2D, ATT, GEO), packed or not; "
        "NAME.opt.tour is taken for the optimum if it is there.",
    ),
    path_option(
        "--human-tours",
        "human_folder",
        metavar="DIR",
        text="People's tours: problems as GraphN.lib, in TSPLIB's format, and tours.csv, packed "
        "or not.",
    ),
    PROCESSES,
)


def measure(
    setting: Setting,
    *,
    map_path: Path | None = None,
    scenario_path: Path | None = None,
    tsp_folder: Path | None = None,
    human_folder: Path | None = None,
) -> Metrics:
    """Measure how short routes are, and how fast they are found: flat, and on a hierarchy of maps.

    With --grid and --scen: every problem of the scenario, on all places of the map and on the
    hierarchy, against the optimal lengths that the scenario states, and against Dijkstra's method
    as scipy has it, on the same graph from the same goal. Takes about half a minute.

    With --tsp: tours past all cities of the problems with 50 to 80 cities, against the optimum,
    which is computed exactly if the folder does not give it. Takes up to a minute a problem.

    With --human-tours: by how much tours of simulated participants are longer than the shortest,
    against those of people on the same problems. What is assumed of the participants is chosen by
    leaving out one problem at a time. Takes some minutes.

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
        metrics |= tours.measure_tsp(tsp_folder, setting.processes)
    if human_folder is not None:
        metrics |= tours.measure_human(human_folder, setting.processes)
    if not metrics:
        raise click.UsageError(
            "there is nothing to plan on: give --grid and --scen, --tsp or --human-tours"
        )

    return metrics
