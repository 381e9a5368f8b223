"""Self-motion between two views, gathered from odometry."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cogmap.errors import MessageError
from schemas.sensing import Odometry

NS_PER_S = 1_000_000_000
FASTEST_M_S = 100.0
FASTEST_TURN_RAD_S = 100.0


class OdometryBuffer:
    """Odometry that no view has accounted for yet, in order of time."""

    def __init__(self, longest_gap_s: float) -> None:
        self._longest_gap_ns = int(longest_gap_s * NS_PER_S)
        self._rows: list[Odometry] = []
        self.newest_ns: int | None = None

    def add(self, row: Odometry) -> None:
        """Take `row` in; one that is no newer than the last is passed over. Raises MessageError for
        a senseless one.
        """
        if abs(row.speed_m_s) > FASTEST_M_S or abs(row.turn_rate_rad_s) > FASTEST_TURN_RAD_S:
            raise MessageError(
                f"odometry: no wheels do {row.speed_m_s:g} m/s and {row.turn_rate_rad_s:g} rad/s"
            )
        self.check_near(row.stamp_ns, "odometry")
        if self.newest_ns is None or row.stamp_ns > self.newest_ns:
            self._rows.append(row)
            self.newest_ns = row.stamp_ns

    def check_near(self, stamp_ns: int, name: str) -> None:
        """Raise MessageError where `stamp_ns` is so far ahead that believing it would shut out all
        that follows.
        """
        if self.newest_ns is not None and stamp_ns > self.newest_ns + self._longest_gap_ns:
            ahead_s = (stamp_ns - self.newest_ns) / NS_PER_S
            raise MessageError(
                f"{name}: {ahead_s:.0f} s ahead of the odometry; restart sensory if that is right"
            )

    def covers(self, stamp_ns: int) -> bool:
        """Whether everything up to `stamp_ns` has come."""
        return self.newest_ns is not None and self.newest_ns >= stamp_ns

    def take(self, until_ns: int) -> tuple[int | None, npt.NDArray[np.float64]]:
        """Remove and return what was sensed up to `until_ns`: when it began, and rows of speed,
        turn rate and dt.
        """
        taken = [row for row in self._rows if row.stamp_ns <= until_ns]
        self._rows = self._rows[len(taken) :]
        rows = [(row.speed_m_s, row.turn_rate_rad_s, row.dt_s) for row in taken]
        began_ns = max(0, taken[0].stamp_ns - round(taken[0].dt_s * NS_PER_S)) if taken else None
        return began_ns, np.array(rows, np.float64).reshape(-1, 3)
