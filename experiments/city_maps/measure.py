"""Every environment traversed often, and how much the learned maps err, by method of correction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cogmap.estimation.alignment import similar_to
from cogmap.experiments import rendered
from cogmap.experiments.city_maps import self_driven
from cogmap.experiments.city_maps.correction import METHODS
from cogmap.experiments.city_maps.drive import COGNITION, VIEW, Tour, driven, sections
from cogmap.experiments.city_maps.environment import BUILDINGS, Environment
from cogmap.experiments.city_maps.guide import Outcome
from cogmap.experiments.city_maps.kept import traverse_once
from cogmap.experiments.city_maps.observer import Traversal
from cogmap.experiments.city_maps.streets import Points
from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.config import Sections
from cogmap.services.codelets.rules import OURS
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Drawn

TRAVERSALS = 12
MAPS = 8
NOISE = Noise(speed=0.1, turn=0.1, drift_rad_per_sqrt_m=0.0)


@dataclass(frozen=True, eq=False)
class Job:
    """One traversal of one environment, by a preset of rules, with factors of noise that are
    `drawn` anew for each view or leg. The agent drives itself if it is `self_driven`.
    """

    environment: Environment
    number: int
    noise: Noise
    seed: int
    rules: str = OURS
    drawn: Drawn = VIEW
    self_driven: bool = False


@dataclass(frozen=True)
class Budget:
    """How often each environment is traversed, from which seed, on how many processes, by which
    preset of rules, in which folder traversals are kept as they end, if any, how often factors of
    noise are `drawn` anew, and whether agents drive themselves.
    """

    traversals: int
    seed: int
    processes: int
    progress: Progress = lambda share: None
    rules: str = OURS
    kept: Path | None = None
    drawn: Drawn = VIEW
    self_driven: bool = False


@dataclass(frozen=True, eq=False)
class Drive:
    """A traversal by one method of correction, and the folder that it is kept in, if any."""

    configured: Sections
    kept: Path | None

    def traversed(self) -> Traversal:
        """Drive it, unless it is kept already."""
        return traverse_once(self.configured, self.kept)


@dataclass(frozen=True, eq=False)
class Learned:
    """What one traversal left, by METHODS: error in km^2, buildings (8, 2), path (n, 2), road (k,
    2).

    `error_km2` is also that by path integration alone: of WHEELS and, with cameras, of FUSED
    self-motion. `outcomes` are how the drives ended, none if the agent was led.
    """

    error_km2: dict[str, float]
    missing: int
    buildings_m: dict[str, Points]
    path_m: dict[str, Points]
    road_m: dict[str, Points]
    outcomes: dict[str, Outcome] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class CityMap:
    """One environment, what was learned of it in each traversal, and errors averaged over them."""

    environment: Environment
    learned: tuple[Learned, ...]

    def error_km2(self, method: str) -> float:
        """Return the mean error over the traversals."""
        errors_km2 = [one.error_km2[method] for one in self.learned]
        return float(np.mean(errors_km2))

    def aligned_error_km2(self, method: str) -> float:
        """Return the mean error over the traversals if maps are turned, moved and scaled first, as
        people's were.
        """
        true_m = self.environment.buildings_m
        errors_km2 = [aligned_error_km2(one.buildings_m[method], true_m) for one in self.learned]
        return float(np.mean(errors_km2))

    @property
    def typical(self) -> Learned:
        """Return the traversal whose corrected error is the median one."""
        errors_km2 = [one.error_km2["heading"] for one in self.learned]
        order = np.argsort(errors_km2, kind="stable")
        middle = (len(order) - 1) // 2
        typical = int(order[middle])
        return self.learned[typical]


def measure(environments: Sequence[Environment], noise: Noise, budget: Budget) -> list[CityMap]:
    """Measure all environments: the same seed gives the same, whatever the number of processes."""
    every = jobs(
        environments,
        noise,
        budget.traversals,
        budget.seed,
        budget.rules,
        drawn=budget.drawn,
        self_driven=budget.self_driven,
    )
    drives = [
        Drive(configured, budget.kept)
        for job in every
        for configured in configurations(job).values()
    ]
    traversals = parallel_map(Drive.traversed, drives, budget.processes, budget.progress)

    learned = []
    for number, job in enumerate(every):
        first = number * len(METHODS)
        own = traversals[first : first + len(METHODS)]
        learned.append(_learned(job, dict(zip(METHODS, own, strict=True))))

    maps = []

    for place, environment in enumerate(environments):
        first = place * budget.traversals
        of_map = learned[first : first + budget.traversals]
        city = CityMap(environment, tuple(of_map))
        maps.append(city)

    return maps


def jobs(
    environments: Sequence[Environment],
    noise: Noise,
    traversals: int,
    seed: int,
    rules: str = OURS,
    *,
    drawn: Drawn = VIEW,
    self_driven: bool = False,
) -> list[Job]:
    """Return all traversals of each environment, one environment after the other."""
    found = []

    for place, environment in enumerate(environments):
        own_seed = seed * 1000 + place
        for number in range(traversals):
            found.append(Job(environment, number, noise, own_seed, rules, drawn, self_driven))

    return found


def by_cameras(job: Job, progress: Progress) -> Learned:
    """Drive a traversal by each method with buildings that are drawn and recognised."""
    configured = configurations(job)
    maps = rendered.by_cameras(configured, COGNITION, driven, progress)
    return _learned(job, maps)


def configurations(job: Job) -> dict[str, Sections]:
    """Return the configuration of every module for the tour of `job`, by each method, from a
    building and in a direction drawn from the seed. Each method gets the same noise.
    """
    rng = np.random.default_rng([job.seed, 0xCAFE, job.number])
    tour = Tour(
        start=int(rng.integers(BUILDINGS)),
        backward=bool(rng.integers(2)),
        seed=int(rng.integers(2**32)),
    )
    found = {}

    for method in METHODS:
        if job.self_driven:
            found[method] = self_driven.sections(
                job.environment, tour, job.noise, method, job.rules
            )
            continue
        found[method] = sections(
            job.environment, tour, job.noise, method, job.rules, drawn=job.drawn
        )

    return found


def map_error_km2(learned_m: Points, true_m: Points) -> float:
    """Return the sum of squared errors of the positions in km^2, as the paper has it.

    One that is missing errs as the others do on average; nothing known is NaN.
    """
    offsets_m = learned_m - true_m
    squared_m2 = (offsets_m**2).sum(axis=1)
    is_known = ~np.isnan(squared_m2)

    if not is_known.any():
        return float("nan")

    mean_m2 = float(squared_m2[is_known].mean())
    return mean_m2 * len(squared_m2) / 1e6


def aligned_error_km2(learned_m: Points, true_m: Points) -> float:
    """Return the same of a map that is turned, moved and scaled to fit first (Procrustes)."""
    is_known = ~np.isnan(learned_m[:, 0])
    if not is_known.any():
        return float("nan")

    aligned_m = np.full_like(true_m, np.nan)
    aligned_m[is_known] = similar_to(learned_m[is_known], true_m[is_known])
    return map_error_km2(aligned_m, true_m)


def _learned(job: Job, maps: Mapping[str, Traversal]) -> Learned:
    """Gather the maps of one traversal, by the method that made them."""
    true_m = job.environment.buildings_m
    buildings_m = {method: one.buildings_m for method, one in maps.items()}
    believed_m = buildings_m | maps["none"].alone_m
    return Learned(
        error_km2={name: map_error_km2(found, true_m) for name, found in believed_m.items()},
        missing=sum(one.missing for one in maps.values()),
        buildings_m=buildings_m,
        path_m={method: one.path_m for method, one in maps.items()},
        road_m={method: one.road_m for method, one in maps.items()},
        outcomes={name: one.outcome for name, one in maps.items() if one.outcome is not None},
    )
