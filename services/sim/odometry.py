"""Wheel odometry: the true motion, as cheap wheels measure it. Pure."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import msgspec
import numpy as np

from cogmap.schemas.base import Share
from cogmap.schemas.sensing import Pose


class Noise(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Standard deviations. Speed and turn rate are multiplied by Gaussians of mean one (paper §5.4,
    step 1). Beyond the paper, wheels that slip unequally drift in heading.
    """

    speed: Annotated[
        Share, msgspec.Meta(description="Standard deviation of the factor on speed.")
    ] = 0.1
    turn: Annotated[
        Share, msgspec.Meta(description="Standard deviation of the factor on turn rate.")
    ] = 0.1
    drift_rad_per_sqrt_m: Annotated[
        Share,
        msgspec.Meta(
            description="Standard deviation of heading after a metre, in rad, growing with the "
            "root of the distance."
        ),
    ] = 0.015


FUSED = Noise(speed=0.04, turn=0.005, drift_rad_per_sqrt_m=0.0005)
"""The noise of self-motion that wheels and views give together, for a simulation without views: as
measured along four camera-level laps of the loop, 180 m each. The heading drifts by 0.0005 rad
after a metre and errs by 0.4 % of a turn, the speed by 2 % in a view of four ticks.
"""


class Motion(NamedTuple):
    """A row of self-motion: measured speeds over `dt_s`, and their standard deviations."""

    speed_m_s: float
    turn_rate_rad_s: float
    dt_s: float
    speed_sd_m_s: float = 0.0
    turn_rate_sd_rad_s: float = 0.0


class WheelOdometry:
    """Turns pairs of true poses into noisy speeds, the same from the same seed. What stands still
    is measured without noise.
    """

    def __init__(self, noise: Noise, seed: int) -> None:
        self._noise = noise
        self._rng = np.random.default_rng([seed, 0x0D])

    def measure(self, before: Pose, after: Pose, dt_s: float) -> Motion:
        """Return the wheels' measurement of a motion that took `dt_s`."""
        turn_rad = math.remainder(after.heading_rad - before.heading_rad, math.tau)
        mean_heading_rad = before.heading_rad + turn_rad / 2

        dx_m = after.x_m - before.x_m
        dy_m = after.y_m - before.y_m
        forward_m = dx_m * math.cos(mean_heading_rad) + dy_m * math.sin(mean_heading_rad)

        noise = self._noise
        deviations = (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
        speed, turn, drift = self._rng.normal((1.0, 1.0, 0.0), deviations).tolist()

        speed_m_s = forward_m * speed / dt_s
        measured_rad = turn_rad * turn + drift * math.sqrt(abs(forward_m))
        turn_rate_rad_s = measured_rad / dt_s

        # The deviations follow from what was measured: nobody knows the true motion.
        distance_m = abs(speed_m_s) * dt_s
        drift_sd_rad_s = noise.drift_rad_per_sqrt_m * math.sqrt(distance_m) / dt_s
        return Motion(
            speed_m_s,
            turn_rate_rad_s,
            dt_s,
            noise.speed * abs(speed_m_s),
            math.hypot(noise.turn * abs(turn_rate_rad_s), drift_sd_rad_s),
        )
