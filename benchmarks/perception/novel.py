"""Buildings that nobody was taught, met once: whether each is recognised by its name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

from benchmarks.perception.objects import Sight
from benchmarks.perception.scenes import MIN_TURN_RAD, other_distance
from cogmap.geometry.arrays import Floats
from cogmap.services.workspace.public import RECOGNITION_THRESHOLD


@dataclass(frozen=True)
class Meeting:
    """One view: what was seen, and for each building of the town in which direction of it the robot
    was, and how far away, (buildings, 2).
    """

    sight: Sight
    from_where: Floats


@dataclass(frozen=True)
class Memory:
    """The counts of a town's buildings, of which `met` got a name of their own: of `later`
    sightings so many were `right`.

    `merges` are sightings by the name of another building, and buildings met that were given the
    name of one before; `splits` are sightings by a name that is new, though the building was met;
    `mistaken` ones by a trained class's.
    """

    met: int = 0
    later: int = 0
    right: int = 0
    merges: int = 0
    splits: int = 0
    mistaken: int = 0

    def __add__(self, other: Memory) -> Memory:
        """Add the counts of two towns."""
        return Memory(*map(sum, zip(astuple(self), astuple(other), strict=True)))


def remembered(
    encounters: Sequence[Meeting], afterwards: Sequence[Meeting], trained: frozenset[str]
) -> Memory:
    """Count how the buildings of a town, all novel, were recognised from other sides and distances.

    Each was to be met in the encounter of its number. Sides and distances are other than in that
    one, and in every other encounter that it was seen in. Its name is the first that it was
    recognised by, with an activation over RECOGNITION_THRESHOLD. A building that they gave no
    name, or that of a trained class or of another building, has none: no later sighting of it is
    right. Of later sightings all count, however low their activation.
    """
    names: dict[int, str] = {}
    places = {number: [each.from_where[number]] for number, each in enumerate(encounters)}
    merges = 0
    splits = 0
    mistaken = 0
    later = 0
    right = 0

    for meeting in encounters:
        for number, label, activation in _sightings(meeting):
            places[number].append(meeting.from_where[number])
            if number in names or activation <= RECOGNITION_THRESHOLD:
                continue

            is_taken = label in names.values()
            is_own = not is_taken and label not in trained
            merges += is_taken
            names[number] = label if is_own else ""

    for meeting in afterwards:
        for number, label, _ in _sightings(meeting):
            here_rad, here_m = meeting.from_where[number].tolist()
            turns_rad = [math.remainder(here_rad - rad, math.tau) for rad, _ in places[number]]
            if not all(abs(turn_rad) >= MIN_TURN_RAD for turn_rad in turns_rad):
                continue
            if not all(other_distance(here_m, float(there_m)) for _, there_m in places[number]):
                continue

            is_known = label in names.values()
            is_right = label == names.get(number)
            is_trained = label in trained

            later += 1
            right += is_right
            mistaken += is_trained
            merges += is_known and not is_right
            splits += not is_trained and not is_known

    met = sum(bool(name) for name in names.values())
    return Memory(met, later, right, merges, splits, mistaken)


def _sightings(meeting: Meeting) -> list[tuple[int, str, float]]:
    """Return each building that a segment matches, what it is called, and its activation."""
    found = []

    for segment in meeting.sight.segments:
        building = segment.building
        if building is not None:
            found.append((building.number, segment.label, segment.activation))

    return found
