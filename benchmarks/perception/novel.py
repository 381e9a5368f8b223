"""Buildings that nobody was taught, met once: is each known again, by the name that it was given?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.perception.objects import Sight
from benchmarks.perception.scenes import LEAST_TURN_RAD, other_distance

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Meeting:
    """One view: what was seen, and for each building of the town in which direction of it the robot was, and how far
    away, (buildings, 2)."""

    sight: Sight
    from_where: Floats


@dataclass(frozen=True)
class Memory:
    """What became of the buildings `met`: of their `later` sightings so many were `right`.

    `merges` are sightings by the name of another building, and buildings met that were given the name of one before;
    `splits` are sightings by a name that is new, though the building has one; `mistaken` ones by a trained class's.
    """

    met: int
    later: int
    right: int
    merges: int
    splits: int
    mistaken: int


def remembered(
    encounters: Sequence[Meeting], afterwards: Sequence[Meeting], novel: frozenset[int], trained: frozenset[str]
) -> Memory:
    """How buildings `novel` were known again after their encounters, in views from other sides and distances.

    Other than in every encounter that showed the building. A building that its encounter gave the name of a trained
    class, or of another building, has no name: no later sighting of it is right.
    """
    names: dict[int, str] = {}
    places: dict[int, list[Floats]] = {number: [] for number in novel}
    merges = splits = mistaken = later = right = 0
    for meeting in encounters:
        for number, label in _sightings(meeting, novel):
            places[number].append(meeting.from_where[number])
            if number not in names:
                taken = label in names.values()
                merges += taken
                names[number] = "" if taken or label in trained else label
    for meeting in afterwards:
        for number, label in _sightings(meeting, novel):
            if not places[number] or not all(_elsewhere(meeting.from_where[number], at) for at in places[number]):
                continue
            later += 1
            right += label == names[number]
            mistaken += label in trained
            merges += label != names[number] and label in names.values()
            splits += label not in trained and label not in names.values()
    return Memory(len(names), later, right, merges, splits, mistaken)


def _sightings(meeting: Meeting, novel: frozenset[int]) -> list[tuple[int, str]]:
    """The novel buildings that a segment matches, and what it is called."""
    segments = meeting.sight.segments
    return [(s.building.number, s.label) for s in segments if s.building and s.building.number in novel]


def _elsewhere(now: Floats, then: Floats) -> bool:
    """Whether the place `now` is at another side and distance of a building than `then`."""
    turn_rad = abs(math.remainder(float(now[0] - then[0]), math.tau))
    return turn_rad >= LEAST_TURN_RAD and other_distance(float(now[1]), float(then[1]))
