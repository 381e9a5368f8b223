"""Where the wheels alone would have the agent: their odometry integrated, nothing else."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from schemas.sensing import Odometry


class DeadReckoning:
    """Integrates odometry by midpoints, from the origin, heading along x."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, float, float, float]] = []

    def __bool__(self) -> bool:
        return bool(self._rows)

    def on_odometry(self, odometry: Odometry) -> None:
        """Add one step."""
        stamp_s = odometry.stamp_ns * 1e-9
        if not self._rows:
            self._rows.append((stamp_s - odometry.dt_s, 0.0, 0.0, 0.0))

        _, x_m, y_m, heading_rad = self._rows[-1]
        turn_rad = odometry.turn_rate_rad_s * odometry.dt_s
        middle_rad = heading_rad + turn_rad / 2
        distance_m = odometry.speed_m_s * odometry.dt_s
        x_m += distance_m * math.cos(middle_rad)
        y_m += distance_m * math.sin(middle_rad)
        self._rows.append((stamp_s, x_m, y_m, heading_rad + turn_rad))

    def poses(self, stamps_s: Floats) -> Floats:
        """(n, 3) at each of `stamps_s`, interpolated."""
        stamp_s, *columns = np.array(self._rows).T
        return np.column_stack([np.interp(stamps_s, stamp_s, column) for column in columns])
