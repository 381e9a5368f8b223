"""Wheel odometry: the true motion, as cheap wheels report it. Pure."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np

from schemas.sensing import Odometry, Pose

Share = Annotated[float, msgspec.Meta(ge=0, le=1)]


class Noise(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Standard deviations. Speed and turn rate are multiplied by Gaussians of mean one (paper §5.4,
    step 1).

    Beyond the paper, wheels that slip unequally turn the robot by `drift_rad_per_sqrt_m` over a
    metre.
    """

    speed: Share = 0.1
    turn: Share = 0.1
    drift_rad_per_sqrt_m: Share = 0.015


class WheelOdometry:
    """Turns pairs of true poses into noisy speeds, always the same from the same seed. No motion
    gives no noise.
    """

    def __init__(self, noise: Noise, seed: int) -> None:
        self._noise = noise
        self._rng = np.random.default_rng([seed, 0x0D])

    def measure(self, before: Pose, after: Pose, dt_s: float) -> Odometry:
        """What the wheels say about the way from `before` to `after`, which took `dt_s`."""
        noise = self._noise
        turn_rad = math.remainder(after.heading_rad - before.heading_rad, math.tau)
        middle_rad = before.heading_rad + turn_rad / 2
        forward_m = (after.x_m - before.x_m) * math.cos(middle_rad) + (
            after.y_m - before.y_m
        ) * math.sin(middle_rad)
        speed, turn, drift = self._rng.normal(
            (1.0, 1.0, 0.0), (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
        ).tolist()
        turned_rad = turn_rad * turn + drift * math.sqrt(abs(forward_m))
        return Odometry(
            speed_m_s=forward_m * speed / dt_s, turn_rate_rad_s=turned_rad / dt_s, dt_s=dt_s
        )
