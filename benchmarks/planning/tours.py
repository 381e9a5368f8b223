"""Several goals in order: against the optima of TSPLIB's problems, and against people's tours."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.cli.progress import bar
from cogmap.data import tsplib
from cogmap.data.human_tours import read_folder
from cogmap.data.tsplib import Problem
from cogmap.errors import UsageError
from cogmap.experiments.route_planning import cross_validation
from cogmap.experiments.route_planning.measure import PARTICIPANTS, human_jobs, measure
from cogmap.experiments.route_planning.metrics import human_metrics
from cogmap.experiments.route_planning.optimum import shortest_tour
from cogmap.parallel import parallel_map
from cogmap.services.codelets.public import tours

THRESHOLDS = {
    "hierarchical_above_optimum": at_most(0.08),
    "within_iqr_share": at_least(0.7),
}
MIN_CITIES = 50
MAX_CITIES = 80
SEED = 1


class _Excess(NamedTuple):
    """The length of the shortest tour of one problem, and by what share longer others are, on the
    mean over the cities that they begin at.
    """

    optimum: float
    hierarchical: float
    unstraightened: float
    flat: float


class _Job(NamedTuple):
    folder: Path
    problem: Problem


def measure_tsp(folder: Path, processes: int) -> Metrics:
    """Measure the mean excess over the problems of MIN_CITIES to MAX_CITIES cities, and each.

    A problem's own is the mean over tours that begin at each of its cities. The optimum is that of
    NAME.opt.tour, or else computed exactly. `tsp_left_out` files are of a type that is not read.
    Raises UsageError if no problem is of that size.
    """
    read = tsplib.folder(folder)
    jobs = [
        _Job(folder, problem)
        for problem in read.problems
        if MIN_CITIES <= len(problem) <= MAX_CITIES
    ]
    if not jobs:
        raise UsageError(
            f"{folder} has no problem of {MIN_CITIES} to {MAX_CITIES} cities: give one with some"
        )

    with bar("planning tours") as progress:
        found = parallel_map(_excess, jobs, processes, progress)

    metrics: Metrics = {}
    for planned in ("hierarchical", "unstraightened", "flat"):
        excess = [getattr(one, planned) for one in found]
        metrics[f"{planned}_above_optimum"] = float(np.mean(excess))

    metrics["tsp_problems"] = float(len(found))
    metrics["tsp_left_out"] = float(len(read.left_out))
    for job, one in zip(jobs, found, strict=True):
        name = job.problem.name
        metrics[f"{name}_optimum"] = one.optimum
        metrics[f"{name}_hierarchical_above_optimum"] = one.hierarchical
        metrics[f"{name}_flat_above_optimum"] = one.flat

    return metrics


def measure_human(folder: Path, processes: int) -> Metrics:
    """Measure how far the model's participants agree with the people of a folder of tours.

    What is assumed of participants is chosen by leaving out one problem at a time:
    `within_iqr_share` is the share of problems left out on which they agree. Raises UsageError if
    there are too few problems for that.
    """
    problems = read_folder(folder)
    jobs = human_jobs(problems, PARTICIPANTS, SEED)
    with bar("planning people's problems") as progress:
        planned = measure(jobs, processes, progress)

    with bar("planning by other assumptions") as progress:
        compared = cross_validation.measure(problems, PARTICIPANTS, SEED, processes, progress)

    defaults = human_metrics(planned)
    defaults["within_iqr_share_of_defaults"] = defaults.pop("within_iqr_share_in_sample")
    return defaults | cross_validation.metrics(compared)


def _excess(job: _Job) -> _Excess:
    problem = job.problem
    shortest = tsplib.optimal_tour(job.folder, problem)
    if shortest is None:
        shortest = shortest_tour(problem.lengths)

    optimum = tours.route_length(problem.lengths, shortest, closed=True)
    found = []
    for start in range(len(problem)):
        cities = np.roll(np.arange(len(problem)), -start)
        lengths = problem.lengths[np.ix_(cities, cities)]
        positions = problem.positions[cities]
        routes = (
            tours.order(lengths, positions, tours.TourSettings()),
            tours.order(lengths, positions, tours.TourSettings(straightens=False)),
            tours.follow_activation(lengths),
        )
        found.append([tours.route_length(lengths, route, closed=True) for route in routes])

    hierarchical, unstraightened, flat = np.mean(found, axis=0).tolist()
    return _Excess(
        optimum=optimum,
        hierarchical=hierarchical / optimum - 1.0,
        unstraightened=unstraightened / optimum - 1.0,
        flat=flat / optimum - 1.0,
    )
