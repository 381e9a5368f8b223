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
        steps = np.stack(
            np.meshgrid(np.arange(PHASES), np.arange(PHASES), indexing="ij"), axis=-1
        ).reshape(-1, 2)
        centres_m = steps / PHASES @ self.lattice_m.T
        angles = np.radians([30, 90, 150])
        waves = (
            4
            * np.pi
            / (np.sqrt(3) * self.spacing_m)
            * np.column_stack([np.cos(angles), np.sin(angles)])
        )
        own = (centres_m @ waves.T).astype(np.float32)
        there = (where_m @ waves.T).astype(np.float32)
        total = np.full((len(own), len(there)), -3.0, np.float32)
        for wave in range(3):
            total += np.cos(there[None, :, wave] - own[:, None, wave])
        tuning: npt.NDArray[np.float32] = np.exp(SHARPNESS * total)
        return tuning

    def nearest(self, centres_m: Values) -> Indices:
        """Of positions (n, 2), the cell that has a field there."""
        steps = (
            np.rint(centres_m @ np.linalg.inv(self.lattice_m).T * PHASES).astype(np.intp) % PHASES
        )
        nearest: Indices = steps[:, 0] * PHASES + steps[:, 1]
        return nearest


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
        return np.exp(-(((self.distances_m - sensed_m) / sd_m) ** 2) / 2).astype(np.float32)

    def nearest(self, distances_m: Values) -> Indices:
        """Of distances (n,), the cell that prefers it."""
        nearest: Indices = np.rint(distances_m / BORDER_M).astype(np.intp)
        return nearest


def place_centres_m(side_m: float) -> Values:
    """Where place cells have their fields in a square room: (n, 2), PLACE_M apart."""
    line = np.arange(PLACE_M / 2, side_m, PLACE_M)
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
