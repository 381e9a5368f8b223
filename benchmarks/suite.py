"""Every benchmark and experiment that has a threshold, and how all of them are run in one go."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

from benchmarks import paper
from benchmarks.bus import measure as bus
from benchmarks.cognition import measure as cognition
from benchmarks.cycle import measure as cycle
from benchmarks.explore import measure as explore
from benchmarks.learning import measure as learning
from benchmarks.lifelong import measure as lifelong
from benchmarks.localization import measure as localization
from benchmarks.machine import machine_unit_ms
from benchmarks.map_correction import measure as map_correction
from benchmarks.map_size import measure as map_size
from benchmarks.map_structure import measure as map_structure
from benchmarks.memory import measure as memory
from benchmarks.perception import measure as perception
from benchmarks.perception import photographs, stereo
from benchmarks.place_grid import measure as place_grid
from benchmarks.planning import grid, tours
from benchmarks.report import Metrics, Outcome
from benchmarks.spiking import measure as spiking
from benchmarks.threshold import Thresholds
from cogmap.errors import CogmapError, UsageError
from cogmap.parallel import end_workers, exit_with

MACHINE_UNIT = "machine_unit_ms"
CONES_SCALE = 4.0


@dataclass(frozen=True)
class Setting:
    """What benchmarks are run with: `folder` is for their files, `data` has a user's own sets."""

    folder: Path
    processes: int
    data: Path | None
    announce: Callable[[str], None]

    def set_of(self, name: str) -> Path:
        """The folder of one set in `data`. Raises UsageError where it is missing."""
        if self.data is None:
            raise UsageError(f"it measures on the set {name}: give its folder with --data")

        path = self.data / name
        if not path.is_dir():
            raise UsageError(f"there is no folder {path}: put the set there")

        return path

    def subfolder(self, name: str) -> Path:
        """A new folder of one benchmark in `folder`."""
        path = self.folder / name
        path.mkdir(parents=True, exist_ok=True)
        return path


@dataclass(frozen=True)
class Benchmark:
    """A benchmark by its name on the command line; `measure` returns its metrics by key."""

    name: str
    thresholds: Thresholds
    measure: Callable[[Setting], Metrics]


def _cycle(setting: Setting) -> Metrics:
    folder = setting.subfolder("cycle")
    return cycle.measure(folder, setting.processes, setting.announce)


def _bus(setting: Setting) -> Metrics:
    folder = setting.subfolder("bus")
    return bus.measure(folder, setting.announce)


def _perception(setting: Setting) -> Metrics:
    return perception.measure()


def _cones(setting: Setting) -> Metrics:
    folder = setting.set_of("stereo_cones")
    left = folder / "im2.png"
    right = folder / "im6.png"
    disparity = folder / "disp2.png"
    return stereo.measure(left, right, disparity, CONES_SCALE)


def _camvid(setting: Setting) -> Metrics:
    camvid = setting.set_of("camvid")
    folder = setting.subfolder("camvid")
    return photographs.measure(camvid, folder)


def _camvid_drives(setting: Setting) -> Metrics:
    camvid = setting.set_of("camvid")
    folder = setting.subfolder("camvid-drives")
    return photographs.measure_by_drive(camvid, folder, setting.announce)


def _spiking(setting: Setting) -> Metrics:
    scenes = spiking.measure(spiking.SEED, setting.processes)
    return spiking.metrics(scenes)


def _localization(setting: Setting) -> Metrics:
    folder = setting.set_of("mrclam6")
    return localization.measure(folder, setting.processes)


def _map_correction(setting: Setting) -> Metrics:
    folder = setting.set_of("pose_graphs")
    graph = folder / "manhattanOlson3500_OlsonInit.g2o.xz"
    truth = folder / "manhattanOlson3500_nodes_groundTruth.dat.xz"
    return map_correction.measure(graph, truth)


def _planning(setting: Setting) -> Metrics:
    grids = setting.set_of("street_grids")
    map_path = grids / "Berlin_0_256.map.xz"
    scenario_path = grids / "Berlin_0_256.map.scen.xz"
    return grid.measure(map_path, scenario_path)


def _tours(setting: Setting) -> Metrics:
    problems = setting.set_of("tsplib")
    people = setting.set_of("human_tsp")
    on_problems = tours.measure_tsp(problems, setting.processes)
    return on_problems | tours.measure_human(people, setting.processes)


def _map_size(setting: Setting) -> Metrics:
    return map_size.measure(setting.announce)


def _map_structure(setting: Setting) -> Metrics:
    return map_structure.measure(setting.announce)


def _place_grid(setting: Setting) -> Metrics:
    return place_grid.measure(setting.announce)


def _explore(setting: Setting) -> Metrics:
    return explore.measure(setting.processes)


def _cognition(setting: Setting) -> Metrics:
    folder = setting.subfolder("cognition")
    return cognition.measure(folder, setting.processes, setting.announce)


def _learning(setting: Setting) -> Metrics:
    return learning.measure(setting.processes, setting.announce)


def _lifelong(setting: Setting) -> Metrics:
    return lifelong.measure()


def _memory(setting: Setting) -> Metrics:
    folder = setting.subfolder("memory")
    return memory.measure(folder, setting.processes, setting.announce)


def _cue_integration(setting: Setting) -> Metrics:
    return paper.measure_cue_integration(setting.processes)


def _city_maps(setting: Setting) -> Metrics:
    return paper.measure_city_maps(setting.processes)


SUITE = (
    Benchmark("cycle", cycle.THRESHOLDS, _cycle),
    Benchmark("bus", bus.THRESHOLDS, _bus),
    Benchmark("perception", perception.THRESHOLDS, _perception),
    Benchmark("cones", stereo.THRESHOLDS, _cones),
    Benchmark("camvid", photographs.THRESHOLDS, _camvid),
    Benchmark("camvid-drives", photographs.BY_DRIVE_THRESHOLDS, _camvid_drives),
    Benchmark("spiking", spiking.THRESHOLDS, _spiking),
    Benchmark("localization", localization.THRESHOLDS, _localization),
    Benchmark("map_correction", map_correction.THRESHOLDS, _map_correction),
    Benchmark("map_size", map_size.THRESHOLDS, _map_size),
    Benchmark("map_structure", map_structure.THRESHOLDS, _map_structure),
    Benchmark("place_grid", place_grid.THRESHOLDS, _place_grid),
    Benchmark("planning", grid.THRESHOLDS, _planning),
    Benchmark("tours", tours.THRESHOLDS, _tours),
    Benchmark("explore", explore.THRESHOLDS, _explore),
    Benchmark("cognition", cognition.THRESHOLDS, _cognition),
    Benchmark("memory", memory.THRESHOLDS, _memory),
    Benchmark("learning", learning.THRESHOLDS, _learning),
    Benchmark("lifelong", lifelong.THRESHOLDS, _lifelong),
    Benchmark("cue-integration", paper.CUE_INTEGRATION_THRESHOLDS, _cue_integration),
    Benchmark("city-maps", paper.CITY_MAPS_THRESHOLDS, _city_maps),
)
NAMES = tuple(benchmark.name for benchmark in SUITE)


def selected(only: Sequence[str], skip: Sequence[str]) -> list[Benchmark]:
    """The benchmarks of `only`, all where it is empty, without those of `skip`."""
    wanted = set(only or NAMES) - set(skip)
    return [benchmark for benchmark in SUITE if benchmark.name in wanted]


def run(benchmark: Benchmark, setting: Setting) -> Outcome:
    """Measure one benchmark in a process of its own. A failure of any kind is its outcome, so that
    others still run.

    Libraries that benchmarks load may not go together in one process: the renderer and torch bring
    compilers of one name.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, exit_with, (os.getpid(),)) as process:
        measured = process.submit(_measured, benchmark.measure, setting)
        try:
            metrics, failure = measured.result()
        except BrokenProcessPool:
            metrics = {}
            failure = f"its process died: see what `--only {benchmark.name}` prints"

    return completed(benchmark.name, benchmark.thresholds, metrics, failure)


def _measured(measure: Callable[[Setting], Metrics], setting: Setting) -> tuple[Metrics, str]:
    """The metrics, and why there are none."""
    try:
        return measure(setting), ""
    except CogmapError as error:
        return {}, str(error)
    except Exception as error:
        return {}, f"{type(error).__name__}: {error}"
    finally:
        end_workers()


def completed(name: str, thresholds: Thresholds, metrics: Metrics, failure: str = "") -> Outcome:
    """The outcome of a benchmark that has just run, with the unit of this machine's speed."""
    if not failure:
        metrics = metrics | {MACHINE_UNIT: machine_unit_ms()}

    return Outcome(name, thresholds, metrics, failure)


def merged(outcomes: Sequence[Outcome]) -> Metrics:
    """All metrics by key; a key that an earlier benchmark has gets the benchmark's name before."""
    found: Metrics = {}

    for outcome in outcomes:
        for key, value in outcome.metrics.items():
            unique = key if key not in found else f"{outcome.benchmark}_{key}"
            found[unique] = value

    return found
