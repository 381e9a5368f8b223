"""What eq. 9 can do for a way whose headings err: many laps of path integration alone, each closed
exactly.

Without landmarks or minds: the rule itself, its positions shifted by the share of the loop that
lies before them.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.sim.odometry import Noise
from services.sim.scripted.trajectory import Line

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Laps:
    """Root mean square errors (n,) of the positions of n laps, before and after each is closed."""

    before_m: Floats
    after_m: Floats

    @property
    def ratio(self) -> float:
        """The mean error after over that before."""
        return float(self.after_m.mean() / self.before_m.mean())

    @property
    def helped(self) -> float:
        """The share of laps that came nearer to the truth."""
        return float((self.after_m < self.before_m).mean())


def close_laps(
    corners_m: Sequence[tuple[float, float]], step_m: float, noise: Noise, laps: int, seed: int
) -> Laps:
    """`laps` times once round `corners_m`, which end where they begin, in steps of `step_m`, with
    `noise` each.
    """
    distance_m, turn_rad, begins_rad = _legs(corners_m, step_m)
    heading_rad = begins_rad + _sum_before(turn_rad)
    drift_sd_rad = noise.drift_rad_per_sqrt_m * np.sqrt(distance_m)

    rng = np.random.default_rng(seed)
    speed, drift, turn = rng.normal(0.0, 1.0, (3, laps, len(distance_m)))
    drifted_rad = drift_sd_rad * drift
    turn_error_rad = noise.turn * turn * turn_rad
    measured_m = distance_m * (1 + noise.speed * speed)

    # A leg's own drift counts half on the leg, its turn comes after it.
    heading_error_rad = _sum_before(drifted_rad + turn_error_rad) + drifted_rad / 2
    measured_rad = heading_rad + heading_error_rad
    error_x_m = measured_m * np.cos(measured_rad) - distance_m * np.cos(heading_rad)
    error_y_m = measured_m * np.sin(measured_rad) - distance_m * np.sin(heading_rad)
    error_m = np.cumsum(np.stack([error_x_m, error_y_m], axis=-1), axis=1)

    along_m = np.cumsum(distance_m)
    share = (along_m / along_m[-1])[:, None]
    closed_m = error_m - share * error_m[:, -1:]
    return Laps(_rms_m(error_m), _rms_m(closed_m))


def _legs(corners_m: Sequence[tuple[float, float]], step_m: float) -> tuple[Floats, Floats, float]:
    """Distance and turn (n,) of each leg, first straight on and then on the spot; first heading."""
    line = Line(np.array(corners_m, float))
    stops_m = [*np.arange(0.0, line.length_m, step_m).tolist(), line.length_m]
    legs = []

    for start_m, end_m in itertools.pairwise(stops_m):
        legs += line.legs(start_m, end_m)

    distance_m, turn_rad = np.array(legs).T
    return distance_m, turn_rad, float(line.heading_rad[0])


def _sum_before(values: Floats) -> Floats:
    """The sum of all values before each, along the last axis."""
    sums: Floats = np.cumsum(values, axis=-1) - values
    return sums


def _rms_m(error_m: Floats) -> Floats:
    """Of (laps, n, 2) errors, one a lap."""
    squared_m2 = np.square(error_m).sum(axis=-1)
    return np.asarray(np.sqrt(squared_m2.mean(axis=-1)))
