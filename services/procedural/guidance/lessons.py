"""Learns guidance schemes: what stood where, and where the agent drove from there. Pure."""

from __future__ import annotations

import cmath
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from cogmap.schemas.cognition import Relation
from cogmap.schemas.nodes import NEVER_NS, Self

# Chosen on routes in a town of blocks that were driven once (`benchmarks cognition`).
STEP_M = 1.5
AHEAD_M = 40.0
TURNED_RAD = 0.3
STOP_NS = 5_000_000_000
# Views become conscious so late at most; what is older than that shows that time has gone back.
LATE_NS = 5_000_000_000
MAX_LANDMARKS = 6
MARKED_M = 2.0
MAX_MARKS = 40
MIN_LANDMARKS = 2
BLIND_SHARE = 0.25


class Place(NamedTuple):
    """Where the agent is by path integration, a complex number in metres, and its heading."""

    at_m: complex
    heading_rad: float

    @staticmethod
    def of(agent: Self) -> Place:
        """Return the place of a self node."""
        at_m = complex(agent.odometry.x_m, agent.odometry.y_m)
        return Place(at_m, agent.odometry.heading_rad)

    def to(self, other_m: complex) -> complex:
        """Return another position as seen from here, metres ahead + metres left x i."""
        return (other_m - self.at_m) * cmath.rect(1.0, -self.heading_rad)

    def out(self, seen_m: complex) -> complex:
        """Return the position of what is seen at `seen_m` from here."""
        return self.at_m + seen_m * cmath.rect(1.0, self.heading_rad)


class Lesson(NamedTuple):
    """Landmarks, and the path from there, metres ahead + metres left x i."""

    landmarks: list[Relation]
    path_m: list[complex]


@dataclass
class Begun:
    """A lesson that continues: from which place and how far along the drive it began, and the path
    since.
    """

    landmarks: list[Relation]
    place: Place
    driven_m: float
    path_m: list[complex]

    def ended(self, place: Place) -> Lesson:
        """Make the lesson that ends at a place."""
        return Lesson(self.landmarks, [*self.path_m, self.place.to(place.at_m)])


class Lessons:
    """Begins a lesson every `step_m` of a drive, and each time that the agent has turned.

    A lesson ends `ahead_m` further on, or later if no landmarks are seen meanwhile; and if the
    agent stays for STOP_NS. A shorter stop is part of the drive.
    """

    def __init__(self, step_m: float = STEP_M, ahead_m: float = AHEAD_M) -> None:
        self._step_m = step_m
        self._ahead_m = ahead_m
        self._begun: deque[Begun] = deque()
        self._last: Begun | None = None
        self._seen_ns = NEVER_NS
        self._place: Place | None = None
        self._driven_m = 0.0
        self._marked_m = 0.0
        self._stopped_ns: int | None = None

    def on_view(self, agent: Self, relations: Iterable[Relation], drives: bool) -> list[Lesson]:
        """Return the lessons that end with what is conscious; none if the view became conscious
        after a later one. `drives`: whether the agent does something of its own to get anywhere.
        """
        if 0 <= self._seen_ns - agent.stamp_ns <= LATE_NS:
            return []

        self._seen_ns = agent.stamp_ns
        place = Place.of(agent)
        if self._place is not None:
            self._driven_m += abs(place.at_m - self._place.at_m)
        self._place = place

        if self._driven_m - self._marked_m >= MARKED_M:
            self._marked_m = self._driven_m
            for begun in self._begun:
                if len(begun.path_m) < MAX_MARKS:
                    begun.path_m.append(begun.place.to(place.at_m))

        if not drives:
            if self._stopped_ns is None:
                self._stopped_ns = agent.stamp_ns
            if agent.stamp_ns - self._stopped_ns < STOP_NS:
                return []

            stopped = [begun.ended(place) for begun in self._begun]
            self._begun.clear()
            self._last = None
            return stopped

        self._stopped_ns = None
        self._begin(place, relations)
        ended = []
        while self._begun and self._last is not None:
            # The agent is far enough on, and has begun another lesson meanwhile.
            first_m = self._begun[0].driven_m
            is_far = self._driven_m - first_m >= self._ahead_m
            if not is_far or self._last.driven_m - first_m < self._ahead_m / 2:
                break
            ended.append(self._begun.popleft().ended(place))
        return ended

    def _begin(self, place: Place, relations: Iterable[Relation]) -> None:
        """Begin a lesson, if it is time and there are landmarks; with one alone after a while."""
        nearest = sorted(relations, key=lambda each: (each.range_m, each.look))[:MAX_LANDMARKS]
        is_far = is_blind = True
        if self._last is not None:
            since_m = self._driven_m - self._last.driven_m
            turn = cmath.rect(1.0, place.heading_rad - self._last.place.heading_rad)
            is_far = since_m >= self._step_m or abs(cmath.phase(turn)) >= TURNED_RAD
            is_blind = since_m >= BLIND_SHARE * self._ahead_m
        if not is_far or len(nearest) < (1 if is_blind else MIN_LANDMARKS):
            return

        self._last = Begun(nearest, place, self._driven_m, [0j])
        self._begun.append(self._last)
