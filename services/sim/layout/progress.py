"""How much of its route, or of its time, the robot has completed. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.polylines import distances_along, interpolate
from services.sim.layout.plan import Point

STEP_M = 0.25
WINDOW_M = 8.0


class Progress:
    """The point of the route nearest to the robot, which never moves back: corners may be cut."""

    def __init__(self, line: list[Point]) -> None:
        corners_m = np.array(line)
        along_m = distances_along(corners_m)
        length_m = along_m[-1]

        number = max(2, round(length_m / STEP_M) + 1)
        at_m = np.linspace(0.0, length_m, number)
        self._points_m = interpolate(along_m, corners_m, at_m)

        self._index = 0

    def resume(self, share: float) -> None:
        """Continue from a share of the route."""
        self._index = round(share * self._last)

    def advance(self, x_m: float, y_m: float) -> float:
        """The share of the route that lies behind the robot at this place."""
        end = self._index + round(WINDOW_M / STEP_M)
        ahead_m = self._points_m[self._index : end]

        away_m = ahead_m - (x_m, y_m)
        nearest = np.argmin(np.hypot(*away_m.T))
        self._index += int(nearest)
        return self._index / self._last

    @property
    def _last(self) -> int:
        return len(self._points_m) - 1


def elapsed(now_ns: int, duration_s: float) -> float:
    """The share of its time that a drive without a route has taken."""
    return min(1.0, now_ns / (duration_s * 1e9))
