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
    line = Line(np.array(corners_m, float))
    stops = np.append(np.arange(0.0, line.length_m, step_m), line.length_m)
    # Straight on, then turn on the spot: with drift on the way, and noise in proportion to both.
    legs = np.array(
        [leg for pair in itertools.pairwise(stops.tolist()) for leg in line.legs(*pair)]
    )
    rng = np.random.default_rng(seed)
    speed, drift, turn = rng.normal(0.0, 1.0, (3, laps, len(legs)))
    way, turned = legs.T
    heading = line.heading_rad[0] + np.cumsum(turned) - turned
    drifted = noise.drift_rad_per_sqrt_m * drift * np.sqrt(way)
    off = (
        np.cumsum(drifted + noise.turn * turn * turned, axis=1)
        - noise.turn * turn * turned
        - drifted / 2
    )
    felt = way * (1 + noise.speed * speed)
    errors = [
        np.cumsum(felt * part(heading + off) - way * part(heading), axis=1)
        for part in (np.cos, np.sin)
    ]
    error = np.stack(errors, axis=-1)
    share = (np.cumsum(way) / way.sum())[:, None]
    return Laps(_rms(error), _rms(error - share * error[:, -1:]))


def _rms(error: Floats) -> Floats:
    result: Floats = np.sqrt(np.square(error).sum(axis=-1).mean(axis=-1))
    return result
