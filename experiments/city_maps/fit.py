"""The noise of self-motion, fitted as the paper did: so that learned maps err as much as people's
(paper §6.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from cogmap.experiments.city_maps import published
from cogmap.experiments.city_maps.drive import traverse
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.measure import (
    NOISE,
    Budget,
    Job,
    configurations,
    jobs,
    map_error_km2,
)
from cogmap.experiments.cue_integration.fit import coordinate_descent
from cogmap.parallel import parallel_map
from cogmap.services.sim.odometry import Noise

FIT_TRAVERSALS = 2
FACTORS = (1.4, 1.15)
MAX_NOISE = 1.0
OTHERS = 500_000


def fitted(environments: Sequence[Environment], budget: Budget) -> Noise:
    """Fit speed and turn noise, by coordinate descent, so that maps whose positions alone are
    corrected err as people's do.

    There is one mean for two noises: others would fit as well. The traversals are others than those
    measured with the same seed.
    """
    traversals = min(budget.traversals, FIT_TRAVERSALS)
    seed = budget.seed + OTHERS

    @cache
    def cost(noise: Noise) -> float:
        if max(noise.speed, noise.turn) > MAX_NOISE:
            return float("inf")

        tried = jobs(environments, noise, traversals, seed, budget.rules)
        errors_km2 = parallel_map(positions_error_km2, tried, budget.processes, budget.progress)

        mean_km2 = float(np.mean(errors_km2))
        return (mean_km2 - published.HUMAN_MEAN_KM2) ** 2

    return coordinate_descent(cost, NOISE, FACTORS)


def positions_error_km2(job: Job) -> float:
    """Return the error of the map of one traversal, positions corrected."""
    configured = configurations(job)["positions"]
    learned_m = traverse(configured).buildings_m
    true_m = job.environment.buildings_m
    return map_error_km2(learned_m, true_m)
