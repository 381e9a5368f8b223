"""Buildings that nobody was taught, met once: whether each is recognised by its name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import msgspec
import numpy as np

from benchmarks.perception.objects import Sight
from benchmarks.perception.scenes import MIN_TURN_RAD, other_distance
from cogmap.geometry.arrays import Floats
from cogmap.graph.likeness import is_new_side, look_ratio
from cogmap.schemas.array import Matrix
from cogmap.schemas.sensing import Appearance, Percept

MIN_MET_SHARE = 0.15
"""The share of a view's pixels that a building covers, by its box, when it is met."""

MET_BEFORE = 0.8
"""A building that is well visible was met before if it looks so with this probability: it is seen
so well that it would look so (chosen on three towns that are none of the benchmark's: 0.84 right
and 0.04 wrong; with 0.9 it is 0.81 and 0.03)."""

EVEN = 0.5
"""From this probability on a building that is small or cut off is the one that it looks like."""

SURE = 0.7
"""With less activation a building is not taken for known. LIDA: the threshold of percepts."""


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


class Strangers:
    """Buildings without a name, told apart by their appearance alone, as objects of the map are
    where nothing is known of places: the first encounter with each gives it a name, and it keeps
    what it looks like from other sides once it is surely recognised.
    """

    def __init__(self) -> None:
        self._sides: dict[str, Matrix] = {}

    def named(self, percepts: Sequence[Percept], pixels: int) -> list[Percept]:
        """Name those percepts of a view of so many pixels that perception has no name for.

        One that looks like none that was met is met now if it is well visible: large. Who meets a
        building stands so near that its ends are seldom in view.
        """
        found = []
        for percept in percepts:
            seen = percept.appearance
            if percept.name or seen is None:
                found.append(percept)
                continue

            name, likeness = self._most_alike(seen)
            activation = likeness / (1.0 + likeness)
            _, _, width_px, height_px = percept.box_px
            is_visible = width_px * height_px >= MIN_MET_SHARE * pixels
            is_sure = activation > MET_BEFORE
            if is_visible and not is_sure:
                name = f"stranger-{1 + len(self._sides)}"
                activation = 1.0
            if is_visible or activation > EVEN:
                found.append(msgspec.structs.replace(percept, name=name, activation=activation))
            else:
                found.append(percept)
            if is_visible and is_new_side(seen, self._sides.get(name)):
                self._learn(name, seen)

        return found

    def _learn(self, name: str, seen: Appearance) -> None:
        sides = [np.asarray(seen.direction.numpy(), np.float64)[None]]
        if name in self._sides:
            sides.insert(0, self._sides[name].numpy())
        self._sides[name] = Matrix.of(np.vstack(sides), "<f2")

    def _most_alike(self, seen: Appearance) -> tuple[str, float]:
        """Return who it looks like most, and how much likelier that is than of any other."""
        best = ("", 0.0)
        for name, sides in self._sides.items():
            likeness = look_ratio(seen, sides) or 0.0
            best = max(best, (name, likeness), key=lambda each: each[1])
        return best


def remembered(
    encounters: Sequence[Meeting], afterwards: Sequence[Meeting], trained: frozenset[str]
) -> Memory:
    """Count how the buildings of a town, all novel, were recognised from other sides and distances.

    Each was to be met in the encounter of its number. Sides and distances are other than in that
    one, and in every other encounter that it was seen in. Its name is the first that it was
    recognised by, with an activation over SURE. A building that they gave no
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
            if not label or number in names or activation <= SURE:
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
            is_right = bool(label) and label == names.get(number)
            is_trained = label in trained

            later += 1
            right += is_right
            mistaken += is_trained
            merges += is_known and not is_right
            splits += bool(label) and not is_trained and not is_known

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
