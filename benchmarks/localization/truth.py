"""Motion capture's truth of a robot's path, and how far a path that was believed is from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.optional import trajectory_error_m
from cogmap.data.mrclam import Robot
from cogmap.geometry.arrays import Booleans, Floats

MAX_GAP_S = 0.5


@dataclass(frozen=True, eq=False)
class Truth:
    """(n, 3) true `poses`, and (n,) whether each is known: motion capture saw the robot then."""

    poses: Floats
    is_known: Booleans

    @classmethod
    def at(cls, robot: Robot, stamps_s: Floats) -> Truth:
        """Interpolate the truth at (n,) `stamps_s`, between the times that it was captured at."""
        captured_s, x_m, y_m, heading_rad = robot.truth.T
        columns = []
        for column in (x_m, y_m, np.unwrap(heading_rad)):
            columns.append(np.interp(stamps_s, captured_s, column))

        last = len(captured_s) - 1
        after = np.searchsorted(captured_s, stamps_s).clip(1, last)
        gap_s = captured_s[after] - captured_s[after - 1]
        is_inside = (stamps_s >= captured_s[0]) & (stamps_s <= captured_s[-1])
        is_known = is_inside & (gap_s <= MAX_GAP_S)
        return cls(np.column_stack(columns), is_known)

    def only(self, chosen: Booleans) -> Truth:
        """Return the truth as known at the (n,) `chosen` times alone."""
        return replace(self, is_known=self.is_known & chosen)

    def errors_m(self, path: Floats) -> Floats:
        """Return distances of a (n, 3) `path` from the truth where that is known, (known,)."""
        offset_m = self._offset_m(path)
        distances_m: Floats = np.hypot(offset_m[:, 0], offset_m[:, 1])
        return distances_m

    def rmse_m(self, path: Floats) -> float:
        """Return a (n, 3) `path`'s root mean square distance from the truth where that is known."""
        offset_m = self._offset_m(path)
        squared_m2 = np.square(offset_m).sum(axis=1)
        return float(np.sqrt(squared_m2.mean()))

    def aligned_error_m(self, path: Floats) -> float:
        """Return the same once the path, in a frame of its own, is aligned with the truth."""
        positions_m = path[self.is_known, :2]
        return trajectory_error_m(positions_m, self._positions_m)

    def _offset_m(self, path: Floats) -> Floats:
        return path[self.is_known, :2] - self._positions_m

    @property
    def _positions_m(self) -> Floats:
        known = self.poses[self.is_known]
        return known[:, :2]
