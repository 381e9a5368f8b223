"""A place cell fires when its grid cells and its border cells fire together: Bayes' rule, by
coincidence.

Path integration moves grid cells: in each cycle they represent one position out of its
distribution, the prior. Border cells fire by the likelihood of the sensed distance to a wall where
they prefer to be. A place cell that fires on the coincidence of all its inputs fires in proportion
to the product: its spikes are samples of the posterior (paper eq. 2, figure 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cogmap.estimation.spiking.cells import (
    GAMMA_S,
    SPACINGS_M,
    BorderCells,
    GridModule,
    Spikes,
    Values,
    generate,
    place_centres_m,
)

WEST = 0
SOUTH = 1


@dataclass(frozen=True)
class Border:
    """A sensed distance to a wall: `axis` 0 to the west wall (along x), 1 to the south wall (along
    y).
    """

    axis: int
    sensed_m: float
    sd_m: float


@dataclass(frozen=True)
class Cues:
    """The estimate of path integration, a normal distribution, and what is sensed of walls."""

    mean_m: tuple[float, float]
    covariance_m2: tuple[tuple[float, float], tuple[float, float]]
    borders: tuple[Border, ...]


@dataclass(frozen=True)
class Posterior:
    """A distribution of positions: mean (2,) and covariance (2, 2)."""

    mean_m: Values
    covariance_m2: Values

    @property
    def sd_m(self) -> Values:
        """Return the standard deviation along x and y."""
        variances_m2 = np.diag(self.covariance_m2)
        return np.sqrt(variances_m2)

    def off(self, mean_m: Values) -> float:
        """Return how far another mean is from this one's, in its standard deviations
        (Mahalanobis).
        """
        offset_m = mean_m - self.mean_m
        precision = np.linalg.inv(self.covariance_m2)
        mahalanobis2 = offset_m @ precision @ offset_m
        return float(np.sqrt(mahalanobis2))


def exact(cues: Cues) -> Posterior:
    """Apply Bayes' rule for normal distributions: precisions add, means weigh by them."""
    prior_m2 = np.array(cues.covariance_m2)
    precision = np.linalg.inv(prior_m2)
    weighed = precision @ np.array(cues.mean_m)

    for border in cues.borders:
        axis = border.axis
        border_precision = border.sd_m**-2
        precision[axis, axis] += border_precision
        weighed[axis] += border.sensed_m * border_precision

    covariance_m2 = np.linalg.inv(precision)
    return Posterior(covariance_m2 @ weighed, covariance_m2)


@dataclass(frozen=True)
class Recording:
    """Spikes as bits packed by eight cycles: of grid cells by module, of border cells by border, of
    place cells.

    `centres_m` (n, 2) is where place cell i has its field.
    """

    grid: tuple[Spikes, ...]
    border: tuple[Spikes, ...]
    place: Spikes
    centres_m: Values

    @property
    def counts(self) -> Values:
        """Return how often each place cell fired."""
        counts = np.bitwise_count(self.place).sum(axis=1)
        return np.asarray(counts, np.float64)

    @property
    def posterior(self) -> Posterior:
        """Return the posterior of the samples that place cells' spikes are. Raises ValueError if
        there are fewer than two.
        """
        counts = self.counts
        if counts.sum() < 2:
            raise ValueError("place cells hardly fire: record for longer")

        mean_m = counts @ self.centres_m / counts.sum()
        frequencies = counts.astype(np.int64)
        covariance_m2 = np.cov(self.centres_m, rowvar=False, fweights=frequencies)
        return Posterior(mean_m, covariance_m2)


def record(cues: Cues, side_m: float, seconds: float, rng: np.random.Generator) -> Recording:
    """Return the network's spikes in a square room of `side_m`, as long as `seconds`."""
    cycles = round(seconds / GAMMA_S)
    centres_m = place_centres_m(side_m)
    integrated_m = rng.multivariate_normal(cues.mean_m, cues.covariance_m2, cycles)

    # Packed, all ones: a place cell fires in the cycles in which each of its inputs does.
    place: Spikes = np.full((len(centres_m), math.ceil(cycles / 8)), 0xFF, np.uint8)
    grid = []
    border = []

    for spacing_m in SPACINGS_M:
        module = GridModule(spacing_m)
        share = module.tuning(integrated_m)
        spikes = generate(share, rng)
        place &= spikes[module.nearest(centres_m)]
        grid.append(spikes)

    for wall in cues.borders:
        cells = BorderCells(side_m)
        share = cells.tuning(wall.sensed_m, wall.sd_m)
        spikes = generate(np.repeat(share[:, None], cycles, axis=1), rng)
        place &= spikes[cells.nearest(centres_m[:, wall.axis])]
        border.append(spikes)

    return Recording(tuple(grid), tuple(border), place, centres_m)
