"""How far along its route the robot has come. Pure."""

from __future__ import annotations

import itertools
import math

import numpy as np

from services.sim.layout.plan import Point

_STEP_M = 0.25
_WINDOW_M = 8.0


class Progress:
    """The point of the route nearest to the robot, which never goes back: corners may be cut."""

    def __init__(self, line: list[Point]) -> None:
        along_m = [0.0, *itertools.accumulate(math.dist(a, b) for a, b in itertools.pairwise(line))]
        number = max(2, round(along_m[-1] / _STEP_M) + 1)
        at_m = np.linspace(0.0, along_m[-1], number)
        xs, ys = zip(*line, strict=True)
        self._points = np.column_stack([np.interp(at_m, along_m, xs), np.interp(at_m, along_m, ys)])
        self._at = 0

    def resume(self, share: float) -> None:
        """Go on from so large a share of the route."""
        self._at = round(share * (len(self._points) - 1))

    def advance(self, x_m: float, y_m: float) -> float:
        """The share of the route that lies behind the robot at this place."""
        window = self._points[self._at : self._at + round(_WINDOW_M / _STEP_M)]
        self._at += int(np.argmin(np.hypot(window[:, 0] - x_m, window[:, 1] - y_m)))
        return self._at / (len(self._points) - 1)
