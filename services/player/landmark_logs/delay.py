"""The delay from a command to the wheels' turn, estimated from the senses as the robot drives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import wrap_angle

LAGS_S = np.arange(0.0, 0.525, 0.025)
MAX_GAP_S = 0.6
MIN_PAIRS = 30


class Delay:
    """Compares how a landmark's bearing changes with the turns that the wheels were commanded.

    Of LAGS_S, `lag_s` is the one at which the two agree best so far.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[float, float]] = {}
        self._errors_rad = np.zeros(len(LAGS_S))
        self._pairs = 0

    @property
    def lag_s(self) -> float:
        """Return the lag that agrees best, 0 until there are MIN_PAIRS of observations."""
        if self._pairs < MIN_PAIRS:
            return 0.0

        best = self._errors_rad.argmin()
        return float(LAGS_S[best])

    def observe(self, rows: Floats, heading_rad: Callable[[Floats], Floats]) -> None:
        """Add (n, 4) rows of stamp, subject, range and bearing; `heading_rad` is the wheels'."""
        for stamp_s, subject, _, bearing_rad in rows.tolist():
            before = self._last.get(subject)
            self._last[subject] = (stamp_s, bearing_rad)
            if before is None:
                continue

            before_s, before_rad = before
            if not 0 < stamp_s - before_s < MAX_GAP_S:
                continue

            headings_rad = heading_rad(stamp_s - LAGS_S)
            turned_rad = headings_rad - heading_rad(before_s - LAGS_S)
            error_rad = bearing_rad - before_rad + turned_rad
            self._errors_rad += np.abs(wrap_angle(error_rad))
            self._pairs += 1
