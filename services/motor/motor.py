"""Sensory-motor memory: turns what a motor program wants into wheel speeds, view by view (the
dorsal stream), under reactive layers that the program does not know of.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.errors import MessageError
from cogmap.robot import CLEARANCE_M, HALF_WIDTH_M, TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.sensing import MotorCommand, RangeScan, SpeedLimit
from cogmap.services.motor.aim import Aim, Speed, in_bend, slowest
from cogmap.services.motor.config import Config
from cogmap.services.motor.reactive.near import NearObstacles

# What is farther aside is not in front.
MAX_BEARING_RAD = math.pi / 3
# Of each wheel in a turn on the spot, at most.
TURNING_SPEED_M_S = 0.5
# The robot turns on the spot if its aim is farther aside than the first, or, before an obstacle,
# than the second: else it would drive circles that leave a narrow street.
BEHIND_RAD = 1.0
ASIDE_RAD = 0.3
# At the end of a turn the rest of it would take so long: it ends slowly.
TURN_TIME_S = 0.5


def obstacle_ahead_m(scan: RangeScan) -> float:
    """Measure the distance of the nearest obstacle in the robot's lane, infinite without one.

    It is that of the second nearest sector, as one sector alone may be noise. Raises MessageError
    if bearings and ranges do not pair.
    """
    bearing_rad = np.asarray(scan.bearing_rad.numpy(), float)
    range_m = np.asarray(scan.range_m.numpy(), float)
    if bearing_rad.shape != range_m.shape or bearing_rad.ndim != 1:
        raise MessageError(f"scan with {bearing_rad.shape} bearings and {range_m.shape} ranges")

    is_seen = range_m > 0
    is_in_lane = np.abs(range_m * np.sin(bearing_rad)) < HALF_WIDTH_M
    is_in_front = np.abs(bearing_rad) < MAX_BEARING_RAD
    is_obstacle = is_seen & is_in_lane & is_in_front

    ahead_m = range_m * np.cos(bearing_rad)
    nearest_m = np.sort(ahead_m[is_obstacle])

    return float(nearest_m[1]) if len(nearest_m) > 1 else math.inf


def halted(stamp_ns: int, reason: SpeedLimit, pose_age_ns: int = 0) -> MotorCommand:
    """Make a command that stops the wheels."""
    return MotorCommand(
        stamp_ns=stamp_ns,
        left_wheel_rad_s=0.0,
        right_wheel_rad_s=0.0,
        halted_by=reason,
        pose_age_ns=pose_age_ns,
    )


class SensoryMotorMemory:
    """Steers to where a motor program aims, by pure pursuit, past what is near; more slowly with an
    old pose, and not at all before an obstacle.
    """

    def __init__(self, config: Config, near: NearObstacles) -> None:
        self._config = config
        self._near = near

    def command(
        self, stamp_ns: int, aim: Aim, clear_m: float, pose_age_ns: int = 0
    ) -> MotorCommand:
        """Compute wheel speeds towards `aim`, by a pose that is `pose_age_ns` old, with `clear_m`
        free ahead.

        If the aim is behind, or aside of an obstacle, the robot turns on the spot.
        """
        pose_age_s = pose_age_ns / 1e9
        free_m = max(0.0, clear_m - CLEARANCE_M)
        before_obstacle_m_s = math.sqrt(2 * self._config.braking_m_s2 * free_m)
        speed = slowest(
            aim.speed,
            Speed(before_obstacle_m_s, SpeedLimit.OBSTACLE),
            Speed(self._speed_by_age(pose_age_s), SpeedLimit.POSE_AGE),
        )
        is_blocked = speed.m_s <= 0.0

        may_turn = not is_blocked or speed.limit is SpeedLimit.OBSTACLE
        aside_rad = ASIDE_RAD if is_blocked else BEHIND_RAD
        if may_turn and (aim.on_the_spot or abs(aim.bearing_rad) > aside_rad):
            # Slower near the end of the turn, the more so the older the pose is.
            duration_s = max(TURN_TIME_S, 2 * pose_age_s)
            wanted_m_s = abs(aim.bearing_rad) / duration_s * TRACK_M / 2
            turn_m_s = math.copysign(min(wanted_m_s, TURNING_SPEED_M_S), aim.bearing_rad)
            return _wheels(stamp_ns, -turn_m_s, turn_m_s, speed.limit, pose_age_ns)

        if is_blocked:
            return halted(stamp_ns, speed.limit, pose_age_ns)

        wanted_per_m = 2 * math.sin(aim.bearing_rad) / aim.distance_m
        curvature_per_m = self._near.clear_curvature(wanted_per_m)
        if curvature_per_m is None:
            return halted(stamp_ns, SpeedLimit.OBSTACLE, pose_age_ns)

        speed = slowest(speed, in_bend(curvature_per_m, self._config))
        half_turn_m_s = speed.m_s * curvature_per_m * TRACK_M / 2
        left_m_s = speed.m_s - half_turn_m_s
        right_m_s = speed.m_s + half_turn_m_s
        return _wheels(stamp_ns, left_m_s, right_m_s, speed.limit, pose_age_ns)

    def _speed_by_age(self, age_s: float) -> float:
        """Return the speed that covers `blind_m` in the pose's age, 0 beyond `max_pose_age_s`."""
        if age_s <= 0.0:
            return math.inf
        if age_s > self._config.max_pose_age_s:
            return 0.0
        return self._config.blind_m / age_s


def _wheels(
    stamp_ns: int, left_m_s: float, right_m_s: float, limit: SpeedLimit, pose_age_ns: int
) -> MotorCommand:
    return MotorCommand(
        stamp_ns=stamp_ns,
        left_wheel_rad_s=left_m_s / WHEEL_RADIUS_M,
        right_wheel_rad_s=right_m_s / WHEEL_RADIUS_M,
        slowed_by=limit,
        pose_age_ns=pose_age_ns,
    )
