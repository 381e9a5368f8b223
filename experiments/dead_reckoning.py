"""The path by the wheels alone: their odometry integrated, nothing else."""

from __future__ import annotations

import math

import numpy as np

from cogmap.experiments.reading import Pose
from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import interpolate
from cogmap.schemas.sensing import Odometry


class DeadReckoning:
    """Integrates odometry by midpoints, from the origin, heading along x."""

    def __init__(self) -> None:
        self._stamps_s: list[float] = []
        self._poses: list[Pose] = []

    def __bool__(self) -> bool:
        return bool(self._poses)

    def on_odometry(self, odometry: Odometry) -> None:
        """Add one step."""
        stamp_s = odometry.stamp_ns * 1e-9
        if not self._poses:
            start_s = stamp_s - odometry.dt_s
            self._stamps_s.append(start_s)
            self._poses.append((0.0, 0.0, 0.0))

        distance_m = odometry.speed_m_s * odometry.dt_s
        turn_rad = odometry.turn_rate_rad_s * odometry.dt_s

        x_m, y_m, heading_rad = self._poses[-1]
        middle_rad = heading_rad + turn_rad / 2
        x_m += distance_m * math.cos(middle_rad)
        y_m += distance_m * math.sin(middle_rad)
        heading_rad += turn_rad

        self._stamps_s.append(stamp_s)
        self._poses.append((x_m, y_m, heading_rad))

    def poses(self, stamps_s: Floats) -> Floats:
        """Interpolate the poses (n, 3) at each of `stamps_s`."""
        known_s = np.array(self._stamps_s)
        poses = np.array(self._poses)
        return interpolate(known_s, poses, stamps_s)
