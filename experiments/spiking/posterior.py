"""The exact posterior of a walk, step by step, on a fine grid (eq. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.experiments.spiking.network import WEST, Border
from cogmap.experiments.spiking.room import SIDE_M, START_SD_M
from cogmap.geometry.arrays import Floats

CELL_M = 0.025
AROUND_M = 1.5
"""The grid goes on beyond the walls: what is unknown there must not come in again opposite."""

BIN_M = 0.25
"""Distributions are compared by what they have in squares of this side."""


CELLS = round((SIDE_M + 2 * AROUND_M) / CELL_M)
MIDDLES_M = CELL_M * (np.arange(CELLS) + 0.5) - AROUND_M
WAVES = 2 * np.pi * np.fft.fftfreq(CELLS, CELL_M)


@dataclass(frozen=True)
class GridPosterior:
    """The distribution of the walker's position over squares of CELL_M, (CELLS, CELLS), moved by
    the Fourier transform: exact for any step and normal noise.
    """

    density: Floats

    @classmethod
    def about(cls, start_m: Floats) -> GridPosterior:
        """Begin about (2,) `start_m`, START_SD_M away along x and y."""
        x, y = (np.exp(-(((MIDDLES_M - at_m) / START_SD_M) ** 2) / 2) for at_m in start_m)
        return cls(_normalized(np.outer(x, y)))

    def moved(self, moved_m: Floats, covariance_m2: Floats) -> GridPosterior:
        """Move by (2,) with normal noise of covariance (2, 2)."""
        x = WAVES[:, None]
        y = WAVES[None]
        squared = covariance_m2[0, 0] * x**2 + covariance_m2[1, 1] * y**2
        squared = squared + 2 * covariance_m2[0, 1] * x * y

        shift = np.exp(-1j * (moved_m[0] * x + moved_m[1] * y) - squared / 2)
        density = np.fft.ifft2(np.fft.fft2(self.density) * shift).real
        return GridPosterior(_normalized(density.clip(0.0)))

    def corrected(self, border: Border) -> GridPosterior:
        """Multiply by the likelihood of a sensed wall."""
        deviations = (MIDDLES_M - border.sensed_m) / border.sd_m
        likelihood = np.exp(-(deviations**2) / 2)
        along = likelihood[:, None] if border.axis == WEST else likelihood[None]
        return GridPosterior(_normalized(self.density * along))

    def moments(self) -> tuple[Floats, Floats]:
        """Return the mean (2,) and the covariance (2, 2)."""
        x = self.density.sum(axis=1)
        y = self.density.sum(axis=0)
        mean_m = np.array([x @ MIDDLES_M, y @ MIDDLES_M])
        off_x, off_y = (MIDDLES_M - at for at in mean_m)

        across_m2 = off_x @ self.density @ off_y
        covariance_m2 = np.array([[x @ off_x**2, across_m2], [across_m2, y @ off_y**2]])
        return mean_m, covariance_m2

    def binned(self) -> Floats:
        """Return the probability of each square of BIN_M, (b, b)."""
        wide = round(BIN_M / CELL_M)
        bins = CELLS // wide
        squares = self.density.reshape(bins, wide, bins, wide)
        return np.asarray(squares.sum(axis=(1, 3)))

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Draw positions (count, 2), anywhere in their cells."""
        chosen = rng.choice(self.density.size, count, p=self.density.ravel())
        indices = np.column_stack(np.unravel_index(chosen, self.density.shape))
        within_m = CELL_M * rng.uniform(-0.5, 0.5, (count, 2))
        drawn: Floats = MIDDLES_M[indices] + within_m
        return drawn


def binned(samples_m: Floats) -> Floats:
    """Return the share of (n, 2) samples in each square of BIN_M, as `GridPosterior.binned`."""
    bins = round((SIDE_M + 2 * AROUND_M) / BIN_M)
    edges_m = BIN_M * np.arange(bins + 1) - AROUND_M
    x_m, y_m = samples_m.T
    counts, _, _ = np.histogram2d(x_m, y_m, bins=(edges_m, edges_m))
    shares: Floats = counts / len(samples_m)
    return shares


def total_variation(one: Floats, other: Floats) -> float:
    """Compute the total variation distance of two distributions over the same squares, 0 to 1."""
    return float(np.abs(one - other).sum() / 2)


def _normalized(density: Floats) -> Floats:
    normalized: Floats = density / density.sum()
    return normalized
