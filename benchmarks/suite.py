"""The table of all benchmarks that have a threshold, and how one of them is run in `all`."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks import constants, paper
from benchmarks.access import measure as access
from benchmarks.benchmark import PROCESSES, Benchmark, Setting
from benchmarks.bus import measure as bus
from benchmarks.cognition import measure as cognition
from benchmarks.cycle import measure as cycle
from benchmarks.dashboard import measure as dashboard
from benchmarks.explore import measure as explore
from benchmarks.export import measure as export
from benchmarks.faults import measure as faults
from benchmarks.forge import measure as forge
from benchmarks.fuzz import measure as fuzz
from benchmarks.individuals import measure as individuals
from benchmarks.learning import measure as learning
from benchmarks.lifelong import measure as lifelong
from benchmarks.localization import beacons, trees, without_names
from benchmarks.localization import measure as localization
from benchmarks.log_api import measure as log_api
from benchmarks.map_correction import city_peer, false_groups
from benchmarks.map_correction import measure as map_correction
from benchmarks.map_size import measure as map_size
from benchmarks.map_structure import measure as map_structure
from benchmarks.memory import measure as memory
from benchmarks.partition import measure as partition
from benchmarks.perception import measure as perception
from benchmarks.perception import photographs, stereo, towns
from benchmarks.place_grid import measure as place_grid
from benchmarks.planning import grid, tours
from benchmarks.planning import measure as planning
from benchmarks.real import measure as real
from benchmarks.real import places as real_places
from benchmarks.real import stereo as real_stereo
from benchmarks.report import Metrics, Outcome, with_machine_unit
from benchmarks.ros2 import measure as ros2
from benchmarks.soak import measure as soak
from benchmarks.spiking import measure as spiking
from benchmarks.stall import measure as stall
from cogmap.errors import CogmapError, UsageError
from cogmap.parallel import end_workers, exit_with

SUITE = (
    Benchmark("cycle", cycle.THRESHOLDS, cycle.measure, options=[PROCESSES]),
    Benchmark("access", access.THRESHOLDS, access.measure, options=access.OPTIONS),
    Benchmark("bus", bus.THRESHOLDS, bus.measure, options=bus.OPTIONS),
    Benchmark(
        "perception",
        towns.THRESHOLDS,
        perception.measure,
        options=perception.OPTIONS,
        option_thresholds=stereo.THRESHOLDS
        | photographs.THRESHOLDS
        | photographs.BY_DRIVE_THRESHOLDS,
    ),
    Benchmark(
        "cones",
        stereo.THRESHOLDS,
        perception.measure,
        data={"pair": [f"stereo_cones/{name}.png" for name in ("im2", "im6", "disp2")]},
        arguments={"scale": 4.0},
        has_command=False,
    ),
    Benchmark(
        "camvid",
        photographs.THRESHOLDS,
        perception.measure,
        data={"camvid": "camvid"},
        has_command=False,
    ),
    Benchmark(
        "camvid-drives",
        photographs.BY_DRIVE_THRESHOLDS,
        perception.measure,
        data={"camvid": "camvid"},
        arguments={"is_by_drive": True},
        has_command=False,
    ),
    Benchmark(
        "real",
        real_stereo.THRESHOLDS | real_places.THRESHOLDS,
        real.measure,
        options=real.OPTIONS,
        data={
            "stereo_folder": "kitti_stereo",
            "walks": ["corridor/ref", "corridor/query"],
        },
    ),
    Benchmark("spiking", spiking.THRESHOLDS, spiking.measure, options=spiking.OPTIONS),
    Benchmark(
        "localization",
        localization.THRESHOLDS,
        localization.measure,
        options=localization.OPTIONS,
        data={"folder": "mrclam6"},
        option_thresholds=localization.OPTION_THRESHOLDS,
    ),
    Benchmark(
        "without-names",
        without_names.THRESHOLDS,
        localization.measure,
        data={"folder": "mrclam6"},
        arguments={"is_without_names": True},
        has_command=False,
    ),
    Benchmark(
        "trees",
        trees.THRESHOLDS,
        localization.measure,
        data={"trees": "victoria_park"},
        has_command=False,
    ),
    Benchmark(
        "ranges",
        beacons.THRESHOLDS,
        localization.measure,
        data={"ranges": "plaza1"},
        has_command=False,
    ),
    Benchmark(
        "map_correction",
        map_correction.THRESHOLDS,
        map_correction.measure,
        options=map_correction.OPTIONS,
        data={
            "graph_path": "pose_graphs/manhattanOlson3500_OlsonInit.g2o.xz",
            "truth_path": "pose_graphs/manhattanOlson3500_nodes_groundTruth.dat.xz",
        },
        option_thresholds=false_groups.THRESHOLDS,
    ),
    Benchmark("city_peer", {}, city_peer.measure, options=city_peer.OPTIONS, in_all=False),
    Benchmark("map_size", map_size.THRESHOLDS, map_size.measure),
    Benchmark("map_structure", map_structure.THRESHOLDS, map_structure.measure),
    Benchmark("place_grid", place_grid.THRESHOLDS, place_grid.measure),
    Benchmark(
        "planning",
        grid.THRESHOLDS,
        planning.measure,
        options=planning.OPTIONS,
        data={
            "map_path": "street_grids/Berlin_0_256.map.xz",
            "scenario_path": "street_grids/Berlin_0_256.map.scen.xz",
        },
        option_thresholds=tours.THRESHOLDS,
    ),
    Benchmark(
        "tours",
        tours.THRESHOLDS,
        planning.measure,
        data={"tsp_folder": "tsplib", "human_folder": "human_tsp"},
        has_command=False,
    ),
    Benchmark("explore", explore.THRESHOLDS, explore.measure, options=explore.OPTIONS),
    Benchmark(
        "individuals", individuals.THRESHOLDS, individuals.measure, options=individuals.OPTIONS
    ),
    Benchmark("cognition", cognition.THRESHOLDS, cognition.measure, options=[PROCESSES]),
    Benchmark("memory", memory.THRESHOLDS, memory.measure, options=[PROCESSES]),
    Benchmark("learning", learning.THRESHOLDS, learning.measure, options=[PROCESSES]),
    Benchmark("lifelong", lifelong.THRESHOLDS, lifelong.measure, options=lifelong.OPTIONS),
    Benchmark("dashboard", dashboard.THRESHOLDS, dashboard.measure, options=dashboard.OPTIONS),
    Benchmark("export", export.THRESHOLDS, export.measure, options=export.OPTIONS),
    Benchmark(
        "faults",
        faults.THRESHOLDS,
        faults.measure,
        options=faults.OPTIONS,
        option_thresholds=faults.PART_THRESHOLDS,
    ),
    Benchmark("ros2", ros2.THRESHOLDS, ros2.measure),
    Benchmark("stall", stall.THRESHOLDS, stall.measure, options=stall.OPTIONS),
    Benchmark("partition", partition.THRESHOLDS, partition.measure, options=partition.OPTIONS),
    Benchmark("log_api", log_api.THRESHOLDS, log_api.measure, options=log_api.OPTIONS),
    Benchmark(
        "cue-integration",
        paper.CUE_INTEGRATION_THRESHOLDS,
        paper.measure_cue_integration,
        has_command=False,
    ),
    Benchmark("city-maps", paper.CITY_MAPS_THRESHOLDS, paper.measure_city_maps, has_command=False),
    Benchmark(
        "city-maps-people",
        paper.PEOPLE_THRESHOLDS,
        paper.measure_against_people,
        data={"cities": "city_streets"},
        has_command=False,
    ),
    Benchmark("ablation", {}, paper.measure_ablation, has_command=False),
    Benchmark("fuzz", fuzz.THRESHOLDS, fuzz.measure, options=fuzz.OPTIONS, in_all=False),
    Benchmark("forge", forge.THRESHOLDS, forge.measure, options=forge.OPTIONS, in_all=False),
    Benchmark("soak", soak.THRESHOLDS, soak.measure, options=soak.OPTIONS, in_all=False),
    Benchmark("constants", {}, constants.measure, options=constants.OPTIONS, in_all=False),
)
NAMES = tuple(benchmark.name for benchmark in SUITE)


def selected(only: Sequence[str], skip: Sequence[str]) -> list[Benchmark]:
    """Return the benchmarks of `only`, if it is empty all that are for it, without those of
    `skip`.
    """
    usual = [benchmark.name for benchmark in SUITE if benchmark.in_all]
    wanted = set(only or usual) - set(skip)
    return [benchmark for benchmark in SUITE if benchmark.name in wanted]


def run(benchmark: Benchmark, setting: Setting, data: Path | None) -> Outcome:
    """Measure one benchmark in a process of its own, on the sets in `data`. A failure of any kind
    is its outcome, so that others still run.

    Libraries that benchmarks load may not go together in one process: the renderer and torch bring
    compilers of one name.
    """
    folder = setting.folder / benchmark.name
    folder.mkdir(exist_ok=True)

    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, exit_with, (os.getpid(),)) as process:
        try:
            arguments = benchmark.arguments_in_all(data)
            in_folder = replace(setting, folder=folder)
            measured = process.submit(_measured, benchmark.measure, in_folder, arguments)
            metrics, failure = measured.result()
        except UsageError as error:
            metrics, failure = {}, str(error)
        except BrokenProcessPool:
            metrics = {}
            failure = f"its process died: see what `--only {benchmark.name}` prints"

    if not failure:
        metrics = with_machine_unit(metrics)
    return Outcome(benchmark.name, benchmark.thresholds, metrics, failure)


def _measured(
    measure: Callable[..., Metrics], setting: Setting, arguments: Mapping[str, Any]
) -> tuple[Metrics, str]:
    """Return the metrics, and the reason if there are none."""
    try:
        return measure(setting, **arguments), ""
    except CogmapError as error:
        return {}, str(error)
    except Exception as error:
        return {}, f"{type(error).__name__}: {error}"
    finally:
        end_workers()


def merged(outcomes: Sequence[Outcome]) -> Metrics:
    """Merge all metrics by key; a key that is taken gets its benchmark's name before it."""
    found: Metrics = {}

    for outcome in outcomes:
        for key, value in outcome.metrics.items():
            unique = key if key not in found else f"{outcome.benchmark}_{key}"
            found[unique] = value

    return found
