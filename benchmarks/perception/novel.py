"""Buildings that nobody was taught, met once: whether each is recognised by its name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from benchmarks.perception.objects import Sight
from benchmarks.perception.scenes import MIN_TURN_RAD, other_distance
from cogmap.geometry.arrays import Floats
from cogmap.services.workspace.ingress import RECOGNITION_THRESHOLD


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

    met: int = 0
    later: int = 0
    right: int = 0
    merges: int = 0
    splits: int = 0
    mistaken: int = 0

    def __add__(self, other: Memory) -> Memory:
        """What became of the buildings of two towns."""
        return Memory(
            met=self.met + other.met,
            later=self.later + other.later,
            right=self.right + other.right,
            merges=self.merges + other.merges,
            splits=self.splits + other.splits,
            mistaken=self.mistaken + other.mistaken,
        )


def remembered(
    encounters: Sequence[Meeting], afterwards: Sequence[Meeting], trained: frozenset[str]
) -> Memory:
    """How the buildings of a town, all novel, were recognised from other sides and distances.

    Each was to be met in the encounter of its number. Sides and distances are other than in that
    one, and in every other encounter that it was seen in. Its name is the first that it was
    recognised by, with an activation over RECOGNITION_THRESHOLD. A building that they gave no
    name, or that of a trained class or of another building, has none: no later sighting of it is
    right. Of later sightings all count, however low their activation.
    """
    tally = _Tally(trained)

    for number, meeting in enumerate(encounters):
        tally.places[number] = [meeting.from_where[number]]
    for meeting in encounters:
        tally.meet(meeting)
    for meeting in afterwards:
        tally.see_again(meeting)

    return tally.memory()


@dataclass
class _Tally:
    """The names given so far, the places seen from, and the counts of a Memory."""

    trained: frozenset[str]
    names: dict[int, str] = field(default_factory=dict)
    places: dict[int, list[Floats]] = field(default_factory=dict)
    merges: int = 0
    splits: int = 0
    mistaken: int = 0
    later: int = 0
    right: int = 0

    def meet(self, meeting: Meeting) -> None:
        """Note the names that an encounter gives."""
        for number, label, activation in _sightings(meeting):
            self.places[number].append(meeting.from_where[number])

            if number in self.names or activation <= RECOGNITION_THRESHOLD:
                continue

            is_taken = label in self.names.values()
            is_own = not is_taken and label not in self.trained
            self.merges += is_taken
            self.names[number] = label if is_own else ""

    def see_again(self, meeting: Meeting) -> None:
        """Count the sightings of one later view."""
        for number, label, _ in _sightings(meeting):
            here = meeting.from_where[number]
            if self._was_there(number, here):
                continue

            is_known = label in self.names.values()
            is_right = label == self.names.get(number)
            is_trained = label in self.trained

            self.later += 1
            self.right += is_right
            self.mistaken += is_trained
            self.merges += is_known and not is_right
            self.splits += not is_trained and not is_known

    def _was_there(self, number: int, here: Floats) -> bool:
        """Whether a building was met from about there."""
        return not all(_is_elsewhere(here, there) for there in self.places[number])

    def memory(self) -> Memory:
        """All counts."""
        met = sum(bool(name) for name in self.names.values())
        return Memory(
            met=met,
            later=self.later,
            right=self.right,
            merges=self.merges,
            splits=self.splits,
            mistaken=self.mistaken,
        )


def _sightings(meeting: Meeting) -> list[tuple[int, str, float]]:
    """The buildings that a segment matches, what it is called, and its activation."""
    found = []

    for segment in meeting.sight.segments:
        building = segment.building
        if building is not None:
            found.append((building.number, segment.label, segment.activation))

    return found


def _is_elsewhere(here: Floats, there: Floats) -> bool:
    """Whether `here` is at another side and distance of a building than `there`."""
    here_rad, here_m = here.tolist()
    there_rad, there_m = there.tolist()
    turn_rad = math.remainder(here_rad - there_rad, math.tau)
    return abs(turn_rad) >= MIN_TURN_RAD and other_distance(here_m, there_m)
