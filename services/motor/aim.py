"""What a motor program wants of the wheels, before the reactive layers have their say."""

from __future__ import annotations

import math
from typing import NamedTuple

from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.config import Config


class Speed(NamedTuple):
    """A speed, and what keeps it below cruising speed."""

    m_s: float
    limit: SpeedLimit = SpeedLimit.NONE


class Aim(NamedTuple):
    """The point that the robot steers to, its bearing, left positive, and its distance, and the
    speed at which. With `on_the_spot` it only turns there.
    """

    bearing_rad: float
    distance_m: float
    speed: Speed
    on_the_spot: bool = False


def bearing_of(x_m: float, y_m: float, pose: Pose) -> float:
    """Compute the bearing of a position as seen from a pose, in rad, left positive."""
    direction_rad = math.atan2(y_m - pose.y_m, x_m - pose.x_m)
    return math.remainder(direction_rad - pose.heading_rad, math.tau)


def slowest(*speeds: Speed) -> Speed:
    """Return the lowest of speeds, of equals the first."""
    return min(speeds, key=lambda speed: speed.m_s)


def in_bend(curvature_per_m: float, config: Config) -> Speed:
    """Compute the highest speed on an arc of that curvature, to either side."""
    bend_per_m = max(abs(curvature_per_m), 1e-6)
    return Speed(math.sqrt(config.lateral_m_s2 / bend_per_m), SpeedLimit.BEND)
