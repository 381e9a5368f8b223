"""The paper's agent of the experiment without any percept: path integration round a tour, closed by
eq. 9 where it began (paper §5.6, §6.2).

It knows its buildings without fail, and sees each from right beside it. So a traversal takes
milliseconds, and noise can be fitted by thousands of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.experiments.city_maps.drive import FRAME_HZ, SPEED_M_S
from cogmap.experiments.city_maps.environment import BUILDINGS, Environment
from cogmap.experiments.loop_closing.rule import Steps
from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Line

VIEW_M = SPEED_M_S / FRAME_HZ
"""Noise is drawn anew for each view, as in the simulation."""

WHOLE_M = 1e9
"""Noise is alike for all views of a straight piece of a street."""


@dataclass(frozen=True, eq=False)
class RuleTour:
    """A tour in steps, and after which of them each building is passed, `passed` (8,)."""

    steps: Steps
    passed: Indices

    @classmethod
    def of(cls, environment: Environment, start: int, backward: bool, step_m: float) -> RuleTour:
        """Cut the tour from building `start`, and back to it, every `step_m`."""
        lengths_m = environment.leg_lengths_m
        order = np.roll(np.arange(BUILDINGS), -start)
        if backward:
            order = order[::-1]
        ends_m = np.cumsum(lengths_m[order])

        steps = Steps.along(Line(environment.line(start, backward, 0.0, 0.0)), step_m)
        from_end_m = np.abs(steps.along_m - ends_m[:, None])
        return cls(steps, from_end_m.argmin(axis=1))

    def errors_km2(self, noise: Noise, laps: int, rng: np.random.Generator) -> Floats:
        """Return the error of the map that each of `laps` agents learns, (laps,)."""
        error_m = self.steps.errors_m(noise, laps, rng)
        closed_m = self.steps.closed_m(error_m)[:, self.passed]
        squared_m2 = np.square(closed_m).sum(axis=-1)
        return np.asarray(squared_m2.sum(axis=-1) / 1e6)


def rule_tours(
    environments: Sequence[Environment], step_m: float, number: int, seed: int
) -> list[RuleTour]:
    """Draw `number` tours of each environment: from any building, in either direction."""
    tours = []

    for place, environment in enumerate(environments):
        rng = np.random.default_rng([seed, 0xF17, place])
        for _ in range(number):
            start = int(rng.integers(BUILDINGS))
            backward = bool(rng.integers(2))
            tours.append(RuleTour.of(environment, start, backward, step_m))

    return tours


def mean_error_km2(tours: Sequence[RuleTour], noise: Noise, laps: int, seed: int) -> float:
    """Return the mean error over all tours, each driven `laps` times; the same seed draws the same
    factors for any noise.
    """
    means_km2 = []

    for place, tour in enumerate(tours):
        rng = np.random.default_rng([seed, 0xF18, place])
        means_km2.append(tour.errors_km2(noise, laps, rng).mean())

    return float(np.mean(means_km2))
