"""What the wheels say of the motion between two views, how sure that is, and what becomes of it
with what was seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.sensory.visual_odometry import Matrix, Motion

STILL_M = 1e-3


@dataclass(frozen=True)
class WheelNoise:
    """Multiplicative noise on both speeds, and drift in heading with the square root of the way."""

    speed: float
    turn: float
    drift_rad_per_sqrt_m: float

    def total(self, rows: Matrix) -> Motion:
        """The motion that (n, 3) rows of speed, turn rate and duration add up to."""
        way = rows[:, 0] * rows[:, 2]
        turn = rows[:, 1] * rows[:, 2]
        turn_var = (self.turn * turn) ** 2 + self.drift_rad_per_sqrt_m**2 * np.abs(way)
        way_sd = np.sqrt(((self.speed * way) ** 2).sum())
        turn_sd = np.sqrt(turn_var.sum())
        return Motion(float(way.sum()), float(turn.sum()), float(way_sd), float(turn_sd))


def fuse(rows: Matrix, motion: Motion, wheels: Motion) -> Matrix:
    """The rows, (n, 5) with standard deviations of both speeds, made to add up to `motion`.

    The wheels tell how it went on between the two views, `motion` how far it came to.
    """
    if not len(rows):
        return np.zeros((0, 5))
    speed, turn_rate, dt = rows.T
    if abs(wheels.way_m) > STILL_M:
        speed = speed * motion.way_m / wheels.way_m
    turn_rate = turn_rate + (motion.turn_rad - wheels.turn_rad) / dt.sum()
    share = 1 / (dt * np.sqrt(len(rows)))
    return np.column_stack(
        [speed, turn_rate, dt, motion.way_sd_m * share, motion.turn_sd_rad * share]
    )
