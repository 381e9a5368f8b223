"""The noise of path integration."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the mean-one factors of speed and turn (paper §5.4), a leg or a corner at a time, and of
    drift: radians after a metre, growing with the root of the way."""

    speed: float
    turn: float
    drift_rad_per_sqrt_m: float
