"""The wheels' motion between two views, its uncertainty, its fusion with what was seen. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.services.sensory.visual_odometry import Motion

# With less, the ratio of distances is one of noise.
STILL_M = 1e-3


@dataclass(frozen=True)
class WheelNoise:
    """Standard deviations: factors on both speeds, and drift of heading with the root of the
    distance.
    """

    speed: float
    turn: float
    drift_rad_per_sqrt_m: float

    def total(self, rows: Floats) -> Motion:
        """Return the sum of (n, 3) rows of speed, turn rate and duration."""
        speed_m_s, turn_rate_rad_s, dt_s = rows.T
        distance_m = speed_m_s * dt_s
        turn_rad = turn_rate_rad_s * dt_s

        distance_var_m2 = (self.speed * distance_m) ** 2
        drift_var_rad2 = self.drift_rad_per_sqrt_m**2 * np.abs(distance_m)
        factor_var_rad2 = (self.turn * turn_rad) ** 2
        turn_var_rad2 = factor_var_rad2 + drift_var_rad2

        return Motion(
            distance_m=float(distance_m.sum()),
            turn_rad=float(turn_rad.sum()),
            distance_sd_m=float(np.sqrt(distance_var_m2.sum())),
            turn_sd_rad=float(np.sqrt(turn_var_rad2.sum())),
        )


def fuse(rows: Floats, motion: Motion, wheels: Motion) -> Floats:
    """Return the rows, (n, 5) with standard deviations of both speeds, adjusted to add up to
    `motion`.

    The wheels alone measure how the motion was spread over the time between the views.
    """
    if not len(rows):
        return np.zeros((0, 5))

    speed_m_s, turn_rate_rad_s, dt_s = rows.T
    if abs(wheels.distance_m) > STILL_M:
        speed_m_s = speed_m_s * motion.distance_m / wheels.distance_m

    turn_error_rad = motion.turn_rad - wheels.turn_rad
    turn_rate_rad_s = turn_rate_rad_s + turn_error_rad / dt_s.sum()

    share = 1 / (dt_s * np.sqrt(len(rows)))
    speed_sd_m_s = motion.distance_sd_m * share
    turn_rate_sd_rad_s = motion.turn_sd_rad * share

    return np.column_stack([speed_m_s, turn_rate_rad_s, dt_s, speed_sd_m_s, turn_rate_sd_rad_s])
