"""How long after a command the wheels turn: found by the robot's own senses, while it drives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cogmap.geometry.arrays import Floats

LAGS_S = np.arange(0.0, 0.525, 0.025)
TOGETHER_S = 0.6
ENOUGH = 30


class Delay:
    """Compares how a landmark's bearing changes with how the wheels were told to turn, at each of
    `LAGS_S`.

    The lag at which the two agree best, so far.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[float, float]] = {}
        self._off = np.zeros(len(LAGS_S))
        self._pairs = 0

    @property
    def lag_s(self) -> float:
        """None, until there is enough to tell by."""
        return float(LAGS_S[self._off.argmin()]) if self._pairs >= ENOUGH else 0.0

    def see(self, sightings: Floats, heading_rad: Callable[[Floats], Floats]) -> None:
        """Take in (n, 4) rows of stamp, subject, range and bearing, of now."""
        for stamp, subject, _, bearing in sightings.tolist():
            before = self._last.get(subject)
            if before is not None and 0 < stamp - before[0] < TOGETHER_S:
                turned = heading_rad(stamp - LAGS_S) - heading_rad(before[0] - LAGS_S)
                self._off += np.abs(
                    np.remainder(bearing - before[1] + turned + np.pi, 2 * np.pi) - np.pi
                )
                self._pairs += 1
            self._last[subject] = (stamp, bearing)
