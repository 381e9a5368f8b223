"""Odometry between two views. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Odometry

NS_PER_S = 1_000_000_000
# Far more than wheels do: such odometry is a mistake.
MAX_SPEED_M_S = 100.0
MAX_TURN_RATE_RAD_S = 100.0
# A stamp that is further ahead of the odometry is a mistake.
MAX_AHEAD_NS = 60 * NS_PER_S
# Odometry that is further behind shows that time has gone back: repeated is what led to one view.
MAX_BEHIND_NS = 2 * NS_PER_S


class OdometryBuffer:
    """Odometry that no view has accounted for yet, in order of time."""

    def __init__(self) -> None:
        self._rows: list[Odometry] = []
        self.newest_ns: int | None = None

    def add(self, row: Odometry) -> None:
        """Add `row`; one that is no newer than the last is ignored, and one that is far older
        replaces all that is later. Raises MessageError if it is too fast or too far ahead.
        """
        speed_m_s = row.speed_m_s
        turn_rate_rad_s = row.turn_rate_rad_s
        if abs(speed_m_s) > MAX_SPEED_M_S or abs(turn_rate_rad_s) > MAX_TURN_RATE_RAD_S:
            raise MessageError(
                f"odometry: no wheels do {speed_m_s:g} m/s and {turn_rate_rad_s:g} rad/s"
            )

        self.check_near(row.stamp_ns, "odometry")
        if self.newest_ns is not None and row.stamp_ns < self.newest_ns - MAX_BEHIND_NS:
            self._rows = [each for each in self._rows if each.stamp_ns < row.stamp_ns]
            self.newest_ns = None
        if self.newest_ns is None or row.stamp_ns > self.newest_ns:
            self._rows.append(row)
            self.newest_ns = row.stamp_ns

    def check_near(self, stamp_ns: int, name: str) -> None:
        """Raise MessageError if `stamp_ns` is so far ahead that everything up to it would be
        ignored from then on.
        """
        if self.newest_ns is None or stamp_ns <= self.newest_ns + MAX_AHEAD_NS:
            return

        ahead_s = (stamp_ns - self.newest_ns) / NS_PER_S
        raise MessageError(
            f"{name}: {ahead_s:.0f} s ahead of the odometry; restart sensory if that is right"
        )

    def covers(self, stamp_ns: int) -> bool:
        """Return true if everything up to `stamp_ns` has come."""
        return self.newest_ns is not None and self.newest_ns >= stamp_ns

    def take(self, until_ns: int) -> tuple[int | None, Floats]:
        """Remove the odometry up to `until_ns`, and return when it began (None if there is none),
        and (n, 3) rows of speed, turn rate and duration.
        """
        taken = [row for row in self._rows if row.stamp_ns <= until_ns]
        self._rows = self._rows[len(taken) :]
        measured = [(row.speed_m_s, row.turn_rate_rad_s, row.dt_s) for row in taken]
        rows = np.array(measured, np.float64).reshape(-1, 3)
        if not taken:
            return None, rows

        duration_ns = round(taken[0].dt_s * NS_PER_S)
        return max(0, taken[0].stamp_ns - duration_ns), rows
