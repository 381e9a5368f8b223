"""The noise of self-motion, fitted as the paper did: so that learned maps err as much as people's
(paper §6.2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

from cogmap.errors import UsageError
from cogmap.experiments.city_maps import published
from cogmap.experiments.city_maps.drive import LEG, VIEW
from cogmap.experiments.city_maps.environment import Environment
from cogmap.experiments.city_maps.measure import NOISE
from cogmap.experiments.city_maps.rule import VIEW_M, WHOLE_M, mean_error_km2, rule_tours
from cogmap.parallel import Progress
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Drawn

TOURS = 4
LAPS = 25
# Shares of speed and turn between which those are sought that err as people do.
NOISE_RANGE = (0.01, 1.0)
TOLERANCE = 0.01
"""A share of the noise: people's mean is known far less well."""

TYPICAL_TRIALS = 8
OTHERS = 500_000


@dataclass(frozen=True)
class Fit:
    """Noise that was fitted, and how much the paper's rule errs with it on maps that it was fitted
    to, and on maps that it was not, in km^2.
    """

    noise: Noise
    fitted_km2: float
    tested_km2: float


def halves(environments: Sequence[Environment]) -> tuple[list[Environment], list[Environment]]:
    """Split environments by their names' order: the first, third and so on to be fitted to, the
    others to be tested on. Raises UsageError if there is only one.
    """
    if len(environments) < 2:
        raise UsageError("a fit takes two maps or more, to test on one of them: give more --maps")

    ordered = sorted(environments, key=lambda each: each.name)
    return ordered[::2], ordered[1::2]


def fitted(
    to: Sequence[Environment], others: Sequence[Environment], seed: int, progress: Progress
) -> dict[Drawn, Fit]:
    """Fit the noise by which the paper's rule errs on the maps `to` as people do: if factors are
    drawn anew each `view`, and if they are alike for all views of a `leg`.

    One mean cannot tell two noises apart: speed and turn have the same share. The tours are others
    than those measured with the same seed. Raises UsageError if the maps are too small, or too
    large, for any noise.
    """
    by_view = _fitted(to, others, VIEW_M, seed + OTHERS, lambda share: progress(share / 2))
    by_leg = _fitted(to, others, WHOLE_M, seed + OTHERS, lambda share: progress((1 + share) / 2))
    return {VIEW: by_view, LEG: by_leg}


def _fitted(
    to: Sequence[Environment],
    others: Sequence[Environment],
    step_m: float,
    seed: int,
    progress: Progress,
) -> Fit:
    tours = rule_tours(to, step_m, TOURS, seed)
    tried = 0

    def excess_km2(log_share: float) -> float:
        nonlocal tried
        tried += 1
        progress(tried / (tried + TYPICAL_TRIALS))
        error_km2 = mean_error_km2(tours, _noise(log_share), LAPS, seed)
        return error_km2 - published.HUMAN_MEAN_KM2

    low, high = map(math.log, NOISE_RANGE)
    if excess_km2(low) > 0 or excess_km2(high) < 0:
        raise UsageError(
            f"no noise from {NOISE_RANGE[0]} to {NOISE_RANGE[1]} makes maps err by "
            f"{published.HUMAN_MEAN_KM2} km²: give larger or other cities, or --noise"
        )

    noise = _noise(float(brentq(excess_km2, low, high, xtol=TOLERANCE)))
    fitted_km2 = mean_error_km2(tours, noise, LAPS, seed)
    tested = rule_tours(others, step_m, TOURS, seed)
    return Fit(noise, fitted_km2, mean_error_km2(tested, noise, LAPS, seed))


def _noise(log_share: float) -> Noise:
    share = math.exp(log_share)
    return Noise(speed=share, turn=share, drift_rad_per_sqrt_m=NOISE.drift_rad_per_sqrt_m)
