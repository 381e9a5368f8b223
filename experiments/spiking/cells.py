"""Grid, border and place cells as generators of spikes.

Time goes in gamma cycles of 25 ms; a cell spikes at most once in a cycle, and spikes of one cycle
coincide.
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
    """Spikes where a cell fires at `share` of its peak, (cells, cycles), as bits packed by eight
    cycles.
    """
    return np.packbits(rng.random(share.shape, np.float32) < PEAK * share, axis=1)


@dataclass(frozen=True)
class GridModule:
    """Grid cells of one spacing, PHASES x PHASES, whose fields together cover the plane evenly."""

    spacing_m: float

    @property
    def lattice_m(self) -> Values:
        """The two steps from a field to its neighbours, as columns."""
        return self.spacing_m * np.array([[1.0, 0.5], [0.0, np.sqrt(3) / 2]])

    def tuning(self, where_m: Values) -> npt.NDArray[np.float32]:
        """How much of its peak each cell fires at positions (n, 2): (cells, n), 1 in the middle of
        a field.
        """
        waves = self._waves()
        own = (self._centres_m() @ waves.T).astype(np.float32)
        there = (where_m @ waves.T).astype(np.float32)
        total = np.full((len(own), len(there)), -float(len(waves)), np.float32)

        for wave in range(len(waves)):
            phase = there[None, :, wave] - own[:, None, wave]
            total += np.cos(phase)

        return np.asarray(np.exp(SHARPNESS * total), np.float32)

    def _centres_m(self) -> Values:
        """(cells, 2): a field of each cell."""
        phases = np.arange(PHASES)
        steps = np.stack(np.meshgrid(phases, phases, indexing="ij"), axis=-1).reshape(-1, 2)
        return steps / PHASES @ self.lattice_m.T

    def _waves(self) -> Values:
        """(3, 2): the wave vectors, in radians a metre, whose sum peaks in the fields."""
        angles = np.radians([30, 90, 150])
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        per_metre = 4 * np.pi / (np.sqrt(3) * self.spacing_m)
        return np.asarray(per_metre * directions)

    def nearest(self, centres_m: Values) -> Indices:
        """Of positions (n, 2), the cell that has a field there."""
        fields = centres_m @ np.linalg.inv(self.lattice_m).T
        steps = np.rint(fields * PHASES).astype(np.intp) % PHASES
        return np.asarray(steps[:, 0] * PHASES + steps[:, 1])


@dataclass(frozen=True)
class BorderCells:
    """Border cells of one wall, each for one distance from it, up to `farthest_m`."""

    farthest_m: float

    @property
    def distances_m(self) -> Values:
        """What each cell prefers."""
        return np.arange(0.0, self.farthest_m + BORDER_M / 2, BORDER_M)

    def tuning(self, sensed_m: float, sd_m: float) -> npt.NDArray[np.float32]:
        """How much of its peak each cell fires at a sensed distance of that precision: (cells,)."""
        deviations = (self.distances_m - sensed_m) / sd_m
        return np.exp(-(deviations**2) / 2).astype(np.float32)

    def nearest(self, distances_m: Values) -> Indices:
        """Of distances (n,), the cell that prefers it."""
        nearest: Indices = np.rint(distances_m / BORDER_M).astype(np.intp)
        return nearest


def place_centres_m(side_m: float) -> Values:
    """Where place cells have their fields in a square room: (n, 2), PLACE_M apart."""
    line = np.arange(PLACE_M / 2, side_m, PLACE_M)
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
