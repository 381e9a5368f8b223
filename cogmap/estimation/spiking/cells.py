"""Grid, border and place cells as generators of spikes.

Time is counted in gamma cycles of 25 ms; a cell spikes at most once in a cycle, and spikes of one
cycle coincide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
Spikes = npt.NDArray[np.uint8]
Indices = npt.NDArray[np.intp]

GAMMA_S = 0.025
PEAK = 0.8
PHASES = 12
PLACE_M = 0.1
BORDER_M = 0.05
# From one module to the next by the square root of e, so that the fields of all fall together in
# one place only.
SPACINGS_M = (0.5, 0.82, 1.36, 2.24, 3.7)
SHARPNESS = 1.5


def generate(share: npt.NDArray[np.float32], rng: np.random.Generator) -> Spikes:
    """Draw the spikes of cells that fire at `share` of their peak, (cells, cycles), as bits packed
    by eight cycles.
    """
    drawn = rng.random(share.shape, np.float32)
    fires = drawn < PEAK * share
    return np.packbits(fires, axis=1)


@dataclass(frozen=True)
class GridModule:
    """Grid cells of one spacing, PHASES x PHASES, whose fields together cover the plane evenly."""

    spacing_m: float

    @property
    def lattice_m(self) -> Values:
        """Return the two steps from a field to its neighbours, as columns."""
        row_height = np.sqrt(3) / 2
        triangular = np.array([[1.0, 0.5], [0.0, row_height]])
        return self.spacing_m * triangular

    def tuning(self, where_m: Values) -> npt.NDArray[np.float32]:
        """Return how much of its peak each cell fires at positions (n, 2): (cells, n), 1 in the
        middle of a field.
        """
        phases = np.arange(PHASES) / PHASES
        centres_m = pairs(phases, phases) @ self.lattice_m.T
        own = self._waves(centres_m)
        there = self._waves(where_m)
        waves = len(own) // 2
        total = own.T @ there - waves

        share = np.exp(SHARPNESS * total)
        return np.asarray(share, np.float32)

    def _waves(self, where_m: Values) -> npt.NDArray[np.float32]:
        """Return the cosines and sines (6, n) of the phases at positions (n, 2): the product of two
        is the sum over the waves of the cosine of the phase between them.
        """
        phases_rad = self._phases_rad(where_m)
        return np.vstack([np.cos(phases_rad), np.sin(phases_rad)])

    def _phases_rad(self, where_m: Values) -> npt.NDArray[np.float32]:
        """Return the phases (3, n) at positions (n, 2) of three waves, whose sum peaks in the
        fields.
        """
        angles_rad = np.radians([30, 90, 150])
        directions = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
        two_rows_m = np.sqrt(3) * self.spacing_m
        rad_per_m = 4 * np.pi / two_rows_m

        phases_rad: Values = where_m @ (rad_per_m * directions).T
        return phases_rad.astype(np.float32).T

    def nearest(self, centres_m: Values) -> Indices:
        """Return for positions (n, 2) the cell that has a field there."""
        per_field = np.linalg.inv(self.lattice_m)
        fields = centres_m @ per_field.T
        steps = np.rint(fields * PHASES).astype(np.intp)

        along, across = steps.T % PHASES
        return np.asarray(PHASES * along + across)


@dataclass(frozen=True)
class BorderCells:
    """Border cells of one wall, each for one distance from it, up to `farthest_m`."""

    farthest_m: float

    @property
    def distances_m(self) -> Values:
        """Return the distance that each cell prefers."""
        end_m = self.farthest_m + BORDER_M / 2
        return np.arange(0.0, end_m, BORDER_M)

    def tuning(self, sensed_m: float, sd_m: float) -> npt.NDArray[np.float32]:
        """Return how much of its peak each cell fires at a sensed distance of that precision:
        (cells,).
        """
        deviations = (self.distances_m - sensed_m) / sd_m
        share = np.exp(-(deviations**2) / 2)
        return share.astype(np.float32)

    def nearest(self, distances_m: Values) -> Indices:
        """Return for distances (n,) the cell that prefers it."""
        nearest: Indices = np.rint(distances_m / BORDER_M).astype(np.intp)
        return nearest


def place_centres_m(side_m: float) -> Values:
    """Return where place cells have their fields in a square room: (n, 2), PLACE_M apart."""
    line_m = np.arange(PLACE_M / 2, side_m, PLACE_M)
    return pairs(line_m, line_m)


def pairs(first_values: Values, second_values: Values) -> Values:
    """Pair each of the first (n,) values with each of the second (m,), (n m, 2)."""
    first, second = np.meshgrid(first_values, second_values, indexing="ij")
    return np.column_stack([first.ravel(), second.ravel()])
