"""Sensory-motor memory: turns the chosen action into wheel speeds, view by view (the dorsal
stream).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.errors import MessageError
from schemas.sensing import MotorCommand, Pose, RangeScan, SpeedLimit
from services.action.config import Config
from services.action.near import NearObstacles
from services.action.route import Route

MAX_BEARING_RAD = math.pi / 3
TURNING_SPEED_M_S = 0.5
BEHIND_RAD = 1.0
ASIDE_RAD = 0.3
TURN_TIME_S = 0.5


class Speed(NamedTuple):
    """A speed, and what keeps it below cruising speed."""

    m_s: float
    limit: SpeedLimit


class Ahead(NamedTuple):
    """The point that the robot steers to: its bearing, left positive, and its distance."""

    bearing_rad: float
    distance_m: float


def obstacle_ahead_m(scan: RangeScan, half_width_m: float) -> float:
    """Distance of the nearest obstacle in a lane of twice `half_width_m`, infinite without one.

    It is that of the second nearest sector, as one sector alone may be noise. Raises MessageError
    where bearings and ranges do not pair.
    """
    bearing_rad = np.asarray(scan.bearing_rad.numpy(), float)
    range_m = np.asarray(scan.range_m.numpy(), float)
    if bearing_rad.shape != range_m.shape or bearing_rad.ndim != 1:
        raise MessageError(f"scan with {bearing_rad.shape} bearings and {range_m.shape} ranges")

    is_seen = range_m > 0
    is_in_lane = np.abs(range_m * np.sin(bearing_rad)) < half_width_m
    is_in_front = np.abs(bearing_rad) < MAX_BEARING_RAD
    is_obstacle = is_seen & is_in_lane & is_in_front

    ahead_m = range_m * np.cos(bearing_rad)
    nearest_m = np.sort(ahead_m[is_obstacle])

    return float(nearest_m[1]) if len(nearest_m) > 1 else math.inf


def halted(stamp_ns: int, reason: SpeedLimit, pose_age_ns: int = 0) -> MotorCommand:
    """A command that stops the wheels."""
    return MotorCommand(
        stamp_ns=stamp_ns,
        left_wheel_rad_s=0.0,
        right_wheel_rad_s=0.0,
        halted_by=reason,
        pose_age_ns=pose_age_ns,
    )


class SensoryMotorMemory:
    """Follows the route's line by pure pursuit, slower in bends and with an old pose, past what is
    near, and stops before obstacles.
    """

    def __init__(self, config: Config, near: NearObstacles) -> None:
        self._config = config
        self._near = near

    def command(
        self, stamp_ns: int, pose: Pose, route: Route, clear_m: float, pose_age_ns: int = 0
    ) -> MotorCommand:
        """Wheel speeds at `pose`, which is `pose_age_ns` old, with `clear_m` free ahead.

        Where the route leads back, or aside of an obstacle, the robot turns on the spot.
        """
        speed = self._speed(route, clear_m, pose_age_ns / 1e9)
        ahead = self._ahead(route, pose)
        is_blocked = speed.m_s <= 0.0
        may_turn = not is_blocked or speed.limit is SpeedLimit.OBSTACLE
        if may_turn and self._must_turn(ahead.bearing_rad, is_blocked):
            turn_m_s = self._turning_m_s(ahead.bearing_rad, pose_age_ns / 1e9)
            return self._wheels(stamp_ns, -turn_m_s, turn_m_s, speed.limit, pose_age_ns)

        if is_blocked:
            return halted(stamp_ns, speed.limit, pose_age_ns)

        wanted_per_m = 2 * math.sin(ahead.bearing_rad) / ahead.distance_m
        curvature_per_m = self._near.clear_curvature(wanted_per_m)
        if curvature_per_m is None:
            return halted(stamp_ns, SpeedLimit.OBSTACLE, pose_age_ns)

        half_turn_m_s = speed.m_s * curvature_per_m * self._config.track_m / 2
        left_m_s = speed.m_s - half_turn_m_s
        right_m_s = speed.m_s + half_turn_m_s
        return self._wheels(stamp_ns, left_m_s, right_m_s, speed.limit, pose_age_ns)

    def _must_turn(self, bearing_rad: float, is_blocked: bool) -> bool:
        """Whether the point ahead is so far aside that the robot turns before it drives."""
        least_rad = ASIDE_RAD if is_blocked else BEHIND_RAD
        return abs(bearing_rad) > least_rad

    def _turning_m_s(self, bearing_rad: float, pose_age_s: float) -> float:
        """The speed of the right wheel, and of the left one backwards, to turn on the spot: slower
        near the end of the turn, the more so the older the pose is.
        """
        duration_s = max(TURN_TIME_S, 2 * pose_age_s)
        speed_m_s = abs(bearing_rad) / duration_s * self._config.track_m / 2
        return math.copysign(min(speed_m_s, TURNING_SPEED_M_S), bearing_rad)

    def _wheels(
        self,
        stamp_ns: int,
        left_m_s: float,
        right_m_s: float,
        limit: SpeedLimit,
        pose_age_ns: int,
    ) -> MotorCommand:
        radius_m = self._config.wheel_radius_m
        return MotorCommand(
            stamp_ns=stamp_ns,
            left_wheel_rad_s=left_m_s / radius_m,
            right_wheel_rad_s=right_m_s / radius_m,
            slowed_by=limit,
            pose_age_ns=pose_age_ns,
        )

    def _ahead(self, route: Route, pose: Pose) -> Ahead:
        """The point of the route that pure pursuit steers to, as seen from the robot."""
        lookahead_m = self._config.lookahead_m
        target_x_m, target_y_m = route.ahead(lookahead_m)
        dx_m = target_x_m - pose.x_m
        dy_m = target_y_m - pose.y_m

        direction_rad = math.atan2(dy_m, dx_m)
        bearing_rad = math.remainder(direction_rad - pose.heading_rad, math.tau)
        return Ahead(bearing_rad, max(lookahead_m / 2, math.hypot(dx_m, dy_m)))

    def _speed(self, route: Route, clear_m: float, pose_age_s: float) -> Speed:
        """The highest speed that the bend ahead, the end of the route, an obstacle and the pose's
        age allow.
        """
        config = self._config
        braking_distance_m = config.cruise_m_s**2 / (2 * config.braking_m_s2)
        bend_per_m = route.sharpest(braking_distance_m)

        free_m = max(0.0, clear_m - config.clearance_m)

        limits = {
            SpeedLimit.NONE: config.cruise_m_s,
            SpeedLimit.BEND: math.sqrt(config.lateral_m_s2 / max(bend_per_m, 1e-6)),
            SpeedLimit.ROUTE_END: math.sqrt(2 * config.braking_m_s2 * route.left_m),
            SpeedLimit.OBSTACLE: math.sqrt(2 * config.braking_m_s2 * free_m),
            SpeedLimit.POSE_AGE: self._speed_by_age(pose_age_s),
        }
        limit = min(limits, key=lambda each: limits[each])

        return Speed(limits[limit], limit)

    def _speed_by_age(self, age_s: float) -> float:
        """The speed that covers `blind_m` within the pose's age, 0 beyond `max_pose_age_s`."""
        config = self._config
        if age_s <= 0.0:
            return math.inf

        if age_s > config.max_pose_age_s:
            return 0.0

        return config.blind_m / age_s
