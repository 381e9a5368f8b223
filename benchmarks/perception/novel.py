"""Buildings that nobody was taught, met once: is each known again, by the name that it was given?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.perception.objects import Sight
from benchmarks.perception.scenes import LEAST_TURN_RAD, other_distance
from services.workspace.config import Config

RECOGNISED = Config().recognition_threshold
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Meeting:
    """One view: what was seen, and for each building of the town in which direction of it the robot
    was, and how far away, (buildings, 2).
    """

    sight: Sight
    from_where: Floats


@dataclass(frozen=True)
class Memory:
    """What became of the buildings, of which `met` got a name of their own: of `later` sightings so
    many were `right`.

    `merges` are sightings by the name of another building, and buildings met that were given the
    name of one before; `splits` are sightings by a name that is new, though the building was met;
    `mistaken` ones by a trained class's.
    """

    met: int
    later: int
    right: int
    merges: int
    splits: int
    mistaken: int


def remembered(
    encounters: Sequence[Meeting], afterwards: Sequence[Meeting], trained: frozenset[str]
) -> Memory:
    """How the buildings of a town, all novel, were known again, in views from other sides and
    distances.

    Each was to be met in the encounter of its number. Sides and distances are other than in that
    one, and in every one that it was seen in by the way. Its name is the first that it was
    recognised by, with an activation over RECOGNISED. A building that they gave no name, or that of
    a trained class or of another building, has none: no later sighting of it is right. Of later
    sightings all count, however low their activation.
    """
    names: dict[int, str] = {}
    places = {number: [meeting.from_where[number]] for number, meeting in enumerate(encounters)}
    merges = splits = mistaken = later = right = 0
    for meeting in encounters:
        for number, label, activation in _sightings(meeting):
            places[number].append(meeting.from_where[number])
            if number not in names and activation > RECOGNISED:
                taken = label in names.values()
                merges += taken
                names[number] = "" if taken or label in trained else label
    for meeting in afterwards:
        for number, label, _ in _sightings(meeting):
            if not all(_elsewhere(meeting.from_where[number], at) for at in places[number]):
                continue
            later += 1
            right += label == names.get(number)
            mistaken += label in trained
            merges += label != names.get(number) and label in names.values()
            splits += label not in trained and label not in names.values()
    return Memory(sum(map(bool, names.values())), later, right, merges, splits, mistaken)


def _sightings(meeting: Meeting) -> list[tuple[int, str, float]]:
    """The buildings that a segment matches, what it is called, and how surely."""
    segments = meeting.sight.segments
    return [
        (each.building.number, each.label, each.activation) for each in segments if each.building
    ]


def _elsewhere(now: Floats, then: Floats) -> bool:
    """Whether the place `now` is at another side and distance of a building than `then`."""
    turn_rad = abs(math.remainder(float(now[0] - then[0]), math.tau))
    return turn_rad >= LEAST_TURN_RAD and other_distance(float(now[1]), float(then[1]))
