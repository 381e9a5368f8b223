"""Which parts of a large place there are: those near the robot, so that the time to start, to
render and to simulate does not grow with the place. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cogmap.services.sim.layout.plan import Point

# Nearer parts are added, farther ones hidden: beyond the 60 m of CAMERA_RANGE_M, and so far apart
# that a part does not come and go.
ADDED_M = 80.0
HIDDEN_M = 95.0
# How far the robot moves before the parts near it are chosen again, and how many are added then.
MOVED_M = 2.0
MAX_ADDED = 6


@dataclass(frozen=True)
class Piece:
    """A part of a place: its middle, how far it reaches from there, and what adds its bodies."""

    middle_m: Point
    reach_m: float
    add: Callable[[], list[int]]


@dataclass
class Nearby:
    """Adds `pieces` as the robot moves; `hide` takes a body of one that is far away, `show` brings
    it back.
    """

    pieces: list[Piece]
    hide: Callable[[int], None]
    show: Callable[[int], None]
    _built: dict[int, list[int]] = field(default_factory=dict)
    _shown: set[int] = field(default_factory=set)
    _last_m: Point | None = None

    def __post_init__(self) -> None:
        middles = [piece.middle_m for piece in self.pieces]
        middles_m = np.array(middles, float)
        self._middles_m = middles_m.reshape(-1, 2)

        reaches = [piece.reach_m for piece in self.pieces]
        self._reaches_m = np.array(reaches, float)

    def update(self, x_m: float, y_m: float) -> None:
        """Follow the robot: if it moved on a little, add the nearest few that are missing; if it
        was put somewhere else, all that are near.
        """
        moved_m = math.inf if self._last_m is None else math.dist(self._last_m, (x_m, y_m))
        if moved_m < MOVED_M:
            return

        self._last_m = (x_m, y_m)
        away_m = self._middles_m - (x_m, y_m)
        apart_m = np.hypot(away_m[:, 0], away_m[:, 1]) - self._reaches_m

        for number in sorted(self._shown):
            if apart_m[number] > HIDDEN_M:
                self._shown.remove(number)
                for body in self._built[number]:
                    self.hide(body)

        order = np.argsort(apart_m, kind="stable").tolist()
        missing = [
            number for number in order if apart_m[number] <= ADDED_M and number not in self._shown
        ]
        is_moved_on = moved_m <= HIDDEN_M - ADDED_M
        for number in missing[:MAX_ADDED] if is_moved_on else missing:
            self._shown.add(number)
            if number not in self._built:
                self._built[number] = self.pieces[number].add()
                continue

            for body in self._built[number]:
                self.show(body)
