"""Sensory-motor memory: turns the selected action into wheel speeds, view by view (the dorsal
stream).
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.errors import MessageError
from schemas.sensing import MotorCommand, Pose, RangeScan
from services.action.config import Config
from services.action.route import Route


def obstacle_ahead_m(scan: RangeScan, half_width_m: float) -> float:
    """How far it is to the nearest thing in the way, by the second nearest sector: one alone may be
    noise.
    """
    bearing = np.asarray(scan.bearing_rad.numpy(), float)
    distance = np.asarray(scan.range_m.numpy(), float)
    if bearing.shape != distance.shape or bearing.ndim != 1:
        raise MessageError(f"scan with {bearing.shape} bearings and {distance.shape} ranges")
    in_way = (
        (distance > 0)
        & (np.abs(distance * np.sin(bearing)) < half_width_m)
        & (np.abs(bearing) < math.pi / 3)
    )
    ahead = np.sort((distance * np.cos(bearing))[in_way])
    return float(ahead[1]) if len(ahead) > 1 else math.inf


class SensoryMotorMemory:
    """Follows the route's line by pure pursuit, slower in bends, and stops before what is in the
    way.
    """

    def __init__(self, config: Config, route: Route) -> None:
        self._config = config
        self._route = route

    def command(self, stamp_ns: int, pose: Pose, clear_m: float, moving: bool) -> MotorCommand:
        """Wheel speeds at `pose` with `clear_m` free ahead; zero unless `moving`."""
        self._route.advance(pose.x_m, pose.y_m)
        if not moving:
            return MotorCommand(
                stamp_ns=stamp_ns,
                left_wheel_rad_s=0.0,
                right_wheel_rad_s=0.0,
                halted_by="no action",
            )
        config = self._config
        speed = self._speed(clear_m)
        if speed <= 0.0:
            return MotorCommand(
                stamp_ns=stamp_ns, left_wheel_rad_s=0.0, right_wheel_rad_s=0.0, halted_by="obstacle"
            )
        target = self._route.ahead(config.lookahead_m)
        bearing = math.atan2(target[1] - pose.y_m, target[0] - pose.x_m) - pose.heading_rad
        bearing = math.remainder(bearing, 2 * math.pi)
        reach = max(config.lookahead_m / 2, math.hypot(target[0] - pose.x_m, target[1] - pose.y_m))
        curvature = 2 * math.sin(max(-math.pi / 2, min(math.pi / 2, bearing))) / reach
        if abs(bearing) > math.pi / 2:
            speed = min(speed, 0.5)
        half_turn = speed * curvature * config.track_m / 2
        left = (speed - half_turn) / config.wheel_radius_m
        right = (speed + half_turn) / config.wheel_radius_m
        return MotorCommand(stamp_ns=stamp_ns, left_wheel_rad_s=left, right_wheel_rad_s=right)

    def _speed(self, clear_m: float) -> float:
        """As fast as the bend ahead, the end of the route and what is in the way allow."""
        config = self._config
        look_m = config.cruise_m_s**2 / (2 * config.braking_m_s2)
        bend = self._route.sharpest(look_m)
        in_bend = math.sqrt(config.lateral_m_s2 / max(bend, 1e-6))
        to_end = math.sqrt(2 * config.braking_m_s2 * self._route.left_m)
        to_obstacle = math.sqrt(2 * config.braking_m_s2 * max(0.0, clear_m - config.clearance_m))
        return min(config.cruise_m_s, in_bend, to_end, to_obstacle)
