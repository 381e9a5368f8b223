"""Every environment traversed often, and how far the learned maps are off, with and without
correction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.config import Sections
from experiments import rendered
from experiments.city_maps.correction import METHODS
from experiments.city_maps.drive import COGNITION, Tour, driven, sections, traverse
from experiments.city_maps.environment import BUILDINGS, Environment
from experiments.city_maps.observer import Traversal
from experiments.city_maps.streets import Points
from services.sim.odometry import Noise

TRAVERSALS = 12
MAPS = 8
NOISE = Noise(speed=0.1, turn=0.1, drift_rad_per_sqrt_m=0.0)


@dataclass(frozen=True, eq=False)
class Job:
    """One traversal of one environment."""

    environment: Environment
    number: int
    noise: Noise
    seed: int


@dataclass(frozen=True)
class Budget:
    """How often each environment is traversed, and how."""

    traversals: int
    seed: int
    processes: int
    progress: Callable[[float], None] = lambda share: None


@dataclass(frozen=True, eq=False)
class Learned:
    """What one traversal left, by METHODS: error in km^2, buildings (8, 2), path (n, 2), road (k,
    2).

    `error_km2` is also that by path integration alone: of WHEELS and, with cameras, of FUSED
    self-motion.
    """

    error_km2: dict[str, float]
    missing: int
    buildings_m: dict[str, Points]
    path_m: dict[str, Points]
    road_m: dict[str, Points]


@dataclass(frozen=True, eq=False)
class CityMap:
    """One environment, what was learned of it in each traversal, and errors averaged over them."""

    environment: Environment
    learned: tuple[Learned, ...]

    def error_km2(self, method: str) -> float:
        """The mean over the traversals."""
        return float(np.mean([one.error_km2[method] for one in self.learned]))

    @property
    def typical(self) -> Learned:
        """The traversal whose corrected error is the median one."""
        order = np.argsort([one.error_km2["heading"] for one in self.learned], kind="stable")
        return self.learned[int(order[(len(order) - 1) // 2])]


def map_error_km2(learned_m: Points, true_m: Points) -> float:
    """The sum of squared errors of the positions in km^2, as the paper has it; one that is missing
    errs as the others do on average, and nothing known is NaN.
    """
    squared = ((learned_m - true_m) ** 2).sum(axis=1)
    known = squared[~np.isnan(squared)]
    return float(known.mean() * len(squared) / 1e6) if len(known) else float("nan")


def traversed(job: Job) -> Learned:
    """Drive one tour from a building and in a direction drawn from the seed, with the same noise by
    each method.
    """
    return _learned(job, {method: traverse(one) for method, one in configurations(job).items()})


def by_cameras(job: Job, progress: Progress) -> Learned:
    """As `traversed`, with buildings that are drawn and recognised."""
    return _learned(job, rendered.by_cameras(configurations(job), COGNITION, driven, progress))


def configurations(job: Job) -> dict[str, Sections]:
    """That of every module for the tour of `job`, by each method."""
    rng = np.random.default_rng([job.seed, 0xCAFE, job.number])
    tour = Tour(int(rng.integers(BUILDINGS)), bool(rng.integers(2)), int(rng.integers(2**32)))
    return {method: sections(job.environment, tour, job.noise, method) for method in METHODS}


def _learned(job: Job, maps: Mapping[str, Traversal]) -> Learned:
    true_m = job.environment.buildings_m
    return Learned(
        error_km2=_errors_km2(maps, true_m),
        missing=sum(int(np.isnan(one.buildings_m[:, 0]).sum()) for one in maps.values()),
        buildings_m={method: one.buildings_m for method, one in maps.items()},
        path_m={method: one.path_m for method, one in maps.items()},
        road_m={method: one.road_m for method, one in maps.items()},
    )


def _errors_km2(maps: Mapping[str, Traversal], true_m: Points) -> dict[str, float]:
    errors_km2 = {method: map_error_km2(one.buildings_m, true_m) for method, one in maps.items()}

    for name, buildings_m in maps["none"].alone_m.items():
        errors_km2[name] = map_error_km2(buildings_m, true_m)

    return errors_km2


def jobs(
    environments: Sequence[Environment], noise: Noise, traversals: int, seed: int
) -> list[Job]:
    """All traversals of each environment, one environment after the other."""
    return [
        Job(environment, number, noise, seed * 1000 + place)
        for place, environment in enumerate(environments)
        for number in range(traversals)
    ]


def measure(environments: Sequence[Environment], noise: Noise, budget: Budget) -> list[CityMap]:
    """All environments, the same from the same seed whatever the number of processes."""
    number = budget.traversals
    learned = parallel_map(
        traversed, jobs(environments, noise, number, budget.seed), budget.processes, budget.progress
    )
    return [
        CityMap(environment, tuple(learned[place * number : (place + 1) * number]))
        for place, environment in enumerate(environments)
    ]
