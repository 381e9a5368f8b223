"""What eq. 9 can do for a path whose headings err: many laps of path integration alone, each closed
exactly.

Without landmarks or agents: the rule itself, its positions shifted by the share of the loop that
lies before them.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.trajectory import Line

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Laps:
    """Root mean square errors (n,) of the positions of n laps, before and after each is closed."""

    before_m: Floats
    after_m: Floats

    @property
    def ratio(self) -> float:
        """Return the mean error after over that before."""
        before_m = self.before_m.mean()
        after_m = self.after_m.mean()
        return float(after_m / before_m)

    @property
    def helped(self) -> float:
        """Return the share of laps that came nearer to the truth."""
        is_nearer = self.after_m < self.before_m
        return float(is_nearer.mean())


@dataclass(frozen=True, eq=False)
class Steps:
    """A line in n steps, each straight on and then a turn on the spot, (n,) each; it sets out at
    `heading_rad`.
    """

    distance_m: Floats
    turn_rad: Floats
    heading_rad: float

    @classmethod
    def along(cls, line: Line, step_m: float) -> Steps:
        """Cut `line` every `step_m` and at its points."""
        stops_m = np.arange(0.0, line.length_m, step_m).tolist()
        legs = []
        for start_m, end_m in itertools.pairwise([*stops_m, line.length_m]):
            legs += line.legs(start_m, end_m)

        distance_m, turn_rad = np.array(legs).T
        return cls(distance_m, turn_rad, float(line.heading_rad[0]))

    @property
    def along_m(self) -> Floats:
        """Return how far along the line each step ends, (n,)."""
        return np.asarray(np.cumsum(self.distance_m))

    def errors_m(self, noise: Noise, laps: int, rng: np.random.Generator) -> Floats:
        """Return the errors of positions by path integration alone after each step, (laps, n, 2),
        the noise drawn anew for each step.
        """
        heading_rad = self.heading_rad + _sum_before(self.turn_rad)
        true_m = _displacements_m(self.distance_m, heading_rad)

        distance_m, error_rad = _measured(self.distance_m, self.turn_rad, noise, laps, rng)
        measured_m = _displacements_m(distance_m, heading_rad + error_rad)
        return np.asarray(np.cumsum(measured_m - true_m, axis=1))

    def closed_m(self, error_m: Floats) -> Floats:
        """Return (laps, n, 2) errors as eq. 9 leaves them where the line ends at its start: the
        error of the end is taken from each position by the share of the loop before it.
        """
        along_m = self.along_m
        share = along_m / along_m[-1]
        return np.asarray(error_m - share[:, None] * error_m[:, -1:])


def close_laps(
    corners_m: Sequence[tuple[float, float]], step_m: float, noise: Noise, laps: int, seed: int
) -> Laps:
    """Measure `laps` times once round `corners_m`, which end where they begin, in steps of
    `step_m`, with `noise` each.
    """
    steps = Steps.along(Line(np.array(corners_m, float)), step_m)
    error_m = steps.errors_m(noise, laps, np.random.default_rng(seed))
    return Laps(_rms_m(error_m), _rms_m(steps.closed_m(error_m)))


def _measured(
    distance_m: Floats, turn_rad: Floats, noise: Noise, laps: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return distances and errors of headings, (laps, n) each, as the wheels measure the n legs."""
    legs = len(distance_m)
    speed, drift, turn = rng.normal(0.0, 1.0, (3, laps, legs))
    measured_m = distance_m * (1 + noise.speed * speed)

    drift_sd_rad = noise.drift_rad_per_sqrt_m * np.sqrt(distance_m)
    drift_rad = drift_sd_rad * drift
    turn_error_rad = noise.turn * turn * turn_rad

    # A leg's own drift counts half on the leg, its turn comes after it.
    before_rad = _sum_before(drift_rad + turn_error_rad)
    heading_error_rad = before_rad + drift_rad / 2
    return measured_m, heading_error_rad


def _displacements_m(distance_m: Floats, heading_rad: Floats) -> Floats:
    """Return displacements along x and y, (..., 2), of distances at headings of the same shape."""
    x_m = distance_m * np.cos(heading_rad)
    y_m = distance_m * np.sin(heading_rad)
    return np.stack([x_m, y_m], axis=-1)


def _sum_before(values: Floats) -> Floats:
    """Return the sum of all values before each, along the last axis."""
    sums: Floats = np.cumsum(values, axis=-1) - values
    return sums


def _rms_m(error_m: Floats) -> Floats:
    """Return the root mean square of (laps, n, 2) errors, one a lap."""
    squared_m2 = np.square(error_m).sum(axis=-1)
    mean_m2 = squared_m2.mean(axis=-1)
    return np.asarray(np.sqrt(mean_m2))
