"""City maps of experiment 2 by the agent and by gtsam, from the same senses."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path

import click
import msgspec
import numpy as np

from benchmarks import optional
from benchmarks.benchmark import PROCESSES, Setting, path_option
from benchmarks.localization.senses import Moment, label_of
from benchmarks.localization.smoother import Problem
from benchmarks.paper import street_environments
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.experiments.city_maps.correction import HEADING, PLACE_SD_M, PLACE_SD_RAD
from cogmap.experiments.city_maps.drive import MODULES, driven
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.fit import halves
from cogmap.experiments.city_maps.measure import NOISE, Job, configurations, jobs, map_error_km2
from cogmap.experiments.city_maps.observer import WHEELS
from cogmap.experiments.city_maps.sources import grown_environments
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.parallel import parallel_map
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import Percepts, SelfMotion
from cogmap.services import registry

MAPS = 4
SEED = 1
OPTIONS = (
    path_option(
        "--cities",
        metavar="DIR",
        text="Real streets, the half of them that no noise is fitted to, in the place of cities "
        "grown from seeds: a folder of extracts and street graphs.",
    ),
    click.Option(
        ["--maps"],
        type=click.IntRange(1, 1000),
        default=MAPS,
        show_default=True,
        help="How many cities, a map of eight buildings and a tour each.",
    ),
    PROCESSES,
)


def measure(setting: Setting, *, cities: Path | None = None, maps: int = MAPS) -> Metrics:
    """Measure the agent's maps of cities beside those of gtsam, which `make bench-setup` installs.

    Both get the same self-motion, names, ranges and bearings of buildings, and recognised places,
    all with the same stated noise. gtsam solves the whole tour at once (Levenberg and Marquardt):
    from least squares, and from path integration, observations weighed by Cauchy's function, of
    which the better fit counts. Errors are the sum of squared errors of the eight buildings, in
    km². Seconds are of CPU time; the agent's are of the whole drive, simulation and every module
    included. Takes a minute a map.
    """
    optional.gtsam()
    every = jobs(_places(cities, maps), NOISE, 1, SEED)
    with bar("tours") as progress:
        rows = parallel_map(evaluate, every, setting.processes, progress)

    return summary(rows)


def summary(rows: list[Metrics]) -> Metrics:
    """Return the metrics of each map, their means, and ratios of the means."""
    metrics: Metrics = {}
    for key in rows[0]:
        metrics[key] = float(np.mean([row[key] for row in rows]))

    metrics["ours_over_gtsam"] = metrics["ours_km2"] / metrics["gtsam_km2"]
    metrics["ours_over_fused_alone"] = metrics["ours_km2"] / metrics["fused_alone_km2"]
    metrics["gtsam_over_fused_alone"] = metrics["gtsam_km2"] / metrics["fused_alone_km2"]
    is_better = [row["ours_km2"] < row["gtsam_km2"] for row in rows]
    metrics["ours_better_share"] = float(np.mean(is_better))
    for number, row in enumerate(rows, start=1):
        metrics |= {f"map_{number:02d}_{key}": value for key, value in row.items()}

    return metrics


def _places(cities: Path | None, maps: int) -> list[Environment]:
    if cities is None:
        return grown_environments(maps, SEED)

    _, tested = halves(street_environments(cities, SEED))
    return tested[:maps]


def evaluate(job: Job) -> Metrics:
    """Drive one tour; return errors and seconds of the agent and of gtsam."""
    configured = configurations(job)[HEADING]
    senses = Senses(job.environment.names)
    modules = [registry.build(name, configured) for name in MODULES]
    began_s = time.process_time()
    traversal = driven(configured, [*modules, senses.module()])
    driven_s = time.process_time()
    own_m = senses.buildings_m()
    solved_s = time.process_time()

    # The pose at the beginning of the line, where the agent's own frame begins.
    start_m, next_m = np.array(configured["sim"]["trajectory"]["line_m"][:2])
    dx_m, dy_m = next_m - start_m
    origin = np.append(start_m, math.atan2(dy_m, dx_m))

    true_m = job.environment.buildings_m
    return {
        "ours_km2": map_error_km2(traversal.buildings_m, true_m),
        "gtsam_km2": map_error_km2(transform_from(origin, own_m), true_m),
        "fused_alone_km2": map_error_km2(traversal.alone_m[WHEELS], true_m),
        "ours_cpu_s": driven_s - began_s,
        "gtsam_cpu_s": solved_s - driven_s,
    }


@dataclass(frozen=True)
class View:
    """What is sensed at a view: its moment, and the stamps of the views that it is taken for."""

    stamp_ns: int
    moment: Moment
    same_as_ns: list[int]


class Senses:
    """Keeps what the agent senses on a tour past the buildings of these names."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._numbers = {name: number for number, name in enumerate(names)}
        self._motions: list[Floats] = []
        self._views: list[View] = []

    def module(self) -> Module:
        """Build the module that listens."""
        return (
            Module("senses")
            .on(topics.SELF_MOTION, self.on_self_motion)
            .on(topics.PERCEPTS, self.on_percepts)
        )

    def on_self_motion(self, motion: SelfMotion) -> None:
        """Keep what moved."""
        self._motions.append(np.asarray(motion.motions.numpy(), np.float64))

    def on_percepts(self, percepts: Percepts) -> None:
        """Keep a view; names of no building on the tour are left out."""
        known = []
        for percept in percepts.objects:
            number = self._numbers.get(percept.name)
            if number is not None:
                known.append(msgspec.structs.replace(percept, name=label_of(number)))

        stamp_s = percepts.stamp_ns * 1e-9
        moment = Moment(stamp_s, np.vstack(self._motions), known, True)
        matches = [match.view_ns for match in percepts.matches]
        self._views.append(View(percepts.stamp_ns, moment, matches))
        self._motions = []

    def buildings_m(self) -> Floats:
        """Solve for the buildings, (n, 2) in the agent's own frame, NaN for one never seen."""
        plain = self._problem(is_robust=False)
        robust = self._problem(is_robust=True)
        found = [robust.solve(), robust.solve(plain.solve())]
        best = min(found, key=robust.cost)

        return np.array([robust.landmark_m(best, number) for number in self._numbers.values()])

    def _problem(self, is_robust: bool) -> Problem:
        problem = Problem(is_robust=is_robust)
        numbers: dict[int, int] = {}
        for number, view in enumerate(self._views, start=1):
            problem.add(view.moment)
            numbers[view.stamp_ns] = number
            for view_ns in view.same_as_ns:
                if view_ns in numbers:
                    problem.add_match(numbers[view_ns], (PLACE_SD_M, PLACE_SD_M, PLACE_SD_RAD))
        return problem
