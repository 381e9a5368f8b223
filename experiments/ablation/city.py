"""Cities: one tour past eight buildings, at the level of percepts (experiment 2 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cogmap.experiments.ablation.outcome import LOST_OVER_FUSED, Outcome
from cogmap.experiments.ablation.variants import Rules, with_variant
from cogmap.experiments.city_maps.drive import traverse
from cogmap.experiments.city_maps.environment import Environment, environments
from cogmap.experiments.city_maps.measure import NOISE, configurations, jobs, map_error_km2
from cogmap.experiments.city_maps.observer import WHEELS
from cogmap.experiments.city_maps.sources import folder, grown_environments

METHOD = "heading"
"""The method of correction of `city_maps` that is ours."""


@dataclass(frozen=True, eq=False)
class CityDrive:
    """A traversal of an environment, from a building and in a direction drawn from the seed."""

    environment: Environment
    seed: int

    def drive(self, rules: Rules) -> Outcome:
        """Drive it. The error is the sum of the squared errors of the buildings, in km^2.

        Self-motion is that of the wheels: there are no images. Raises CogmapError if a message was
        refused.
        """
        (job,) = jobs([self.environment], NOISE, 1, self.seed)
        traversal = traverse(with_variant(configurations(job)[METHOD], rules))

        true_m = self.environment.buildings_m
        error_km2 = map_error_km2(traversal.buildings_m, true_m)
        fused_km2 = map_error_km2(traversal.alone_m[WHEELS], true_m)
        is_lost = not error_km2 <= LOST_OVER_FUSED**2 * fused_km2
        return Outcome(error_km2, fused_km2, fused_km2, is_lost)


def grown(seeds: Sequence[int]) -> list[CityDrive]:
    """Return a traversal of a city grown from each seed."""
    drives = []

    for seed in seeds:
        (environment,) = grown_environments(1, seed)
        drives.append(CityDrive(environment, seed))

    return drives


def of_extracts(path: Path, seeds: Sequence[int]) -> list[CityDrive]:
    """Return a traversal from each seed of each city in a folder. Raises UsageError if it has
    none.
    """
    drives = []

    for city in folder(path, seeds[0]):
        (environment,) = environments(city, 1, seeds[0])
        drives += [CityDrive(environment, seed) for seed in seeds]

    return drives
