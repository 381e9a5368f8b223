"""An environment of the experiment: streets, eight buildings, and the shortest tour past them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.errors import UsageError
from cogmap.experiments.city_maps.streets import Points, Streets, shortest_path
from cogmap.experiments.city_maps.tour import shortest_tour
from cogmap.geometry.arrays import Indices
from cogmap.geometry.polylines import distances_along, interpolate

BUILDINGS = 8
MAX_KM2 = 4.0
MIN_SIDE_M = 400.0
MAX_SIDE_M = 1e3 * MAX_KM2**0.5
MIN_APART = 0.12
FROM_STREET_M = (4.0, 35.0)
MAX_TRIES = 400
SAME_POINT_M = 1e-6


@dataclass(frozen=True, eq=False)
class City:
    """Where environments are taken from: all its streets, and buildings by name, (n, 2)."""

    name: str
    streets: Streets
    names: tuple[str, ...]
    buildings_m: Points


@dataclass(frozen=True, eq=False)
class Environment:
    """`buildings_m` (8, 2) in the order of the tour; `legs_m[i]` is the line from building i to the
    next.
    """

    name: str
    streets: Streets
    names: tuple[str, ...]
    buildings_m: Points
    legs_m: tuple[Points, ...]

    @property
    def area_km2(self) -> float:
        """Return the area of the rectangle around the buildings."""
        width_m, height_m = np.ptp(self.buildings_m, axis=0).tolist()
        return float(width_m * height_m) / 1e6

    @property
    def leg_lengths_m(self) -> Points:
        """Return the length of each of the `legs_m`, (8,)."""
        return np.array([_step_lengths_m(leg).sum() for leg in self.legs_m])

    @property
    def tour_m(self) -> float:
        """Return the length of the tour."""
        return float(self.leg_lengths_m.sum())

    def line(self, start: int, backward: bool, lead_m: float, overrun_m: float) -> Points:
        """Return the tour past building `start`, all others and `start` again.

        It begins `lead_m` before `start`, so that the building is approached, and ends `overrun_m`
        beyond where it began.
        """
        legs = [*self.legs_m[start:], *self.legs_m[:start]]
        if backward:
            legs.reverse()
            legs = [leg[::-1] for leg in legs]

        whole = _joined(legs)
        reverse_lead = _beginning(whole[::-1], lead_m)
        overrun = _beginning(whole, overrun_m)
        return _joined([reverse_lead[::-1], whole, overrun])


def environments(city: City, number: int, seed: int) -> list[Environment]:
    """Return `number` environments of `city`, from seeds of their own.

    Raises UsageError if the city has no eight buildings that lie far enough apart along its
    streets.
    """
    streets = city.streets.connected()

    # Buildings that stand by a street, neither on it nor far away.
    _, feet_m = streets.nearest(city.buildings_m)
    distances_m = np.hypot(*(city.buildings_m - feet_m).T)
    min_m, max_m = FROM_STREET_M
    usable = np.flatnonzero((distances_m >= min_m) & (distances_m <= max_m))
    found = []

    for count in range(number):
        rng = np.random.default_rng([seed, 0xC1, count])
        chosen = _choose(city.buildings_m, usable, rng)
        if chosen is None:
            raise UsageError(
                f"{city.name}: no {BUILDINGS} buildings by its streets lie far enough apart: "
                "give a larger extract"
            )

        name = city.name if number == 1 else f"{city.name} {count + 1}"
        order, legs_m = _tour(streets, city.buildings_m[chosen])
        in_order = [chosen[place] for place in order]
        found.append(
            Environment(
                name=name,
                streets=streets,
                names=tuple(city.names[building] for building in in_order),
                buildings_m=city.buildings_m[in_order],
                legs_m=tuple(legs_m),
            )
        )

    return found


def _choose(buildings_m: Points, usable: Indices, rng: np.random.Generator) -> list[int] | None:
    """Choose eight buildings in a square of random size and place, none too near to another.

    None if MAX_TRIES squares have none.
    """
    if len(usable) < BUILDINGS:
        return None

    usable_m = buildings_m[usable]
    corner_m = usable_m.min(axis=0)
    extent_m = np.ptp(usable_m, axis=0)
    max_side_m = np.clip(extent_m.max(), MIN_SIDE_M, MAX_SIDE_M)

    for _ in range(MAX_TRIES):
        side_m = float(rng.uniform(MIN_SIDE_M, max_side_m))
        room_m = np.maximum(extent_m - side_m, 0)
        lower_m = corner_m + rng.uniform(0, 1, 2) * room_m

        is_within = (usable_m >= lower_m) & (usable_m <= lower_m + side_m)
        inside = usable[is_within.all(axis=1)]
        candidates = rng.permutation(inside).tolist()
        chosen = _apart(buildings_m, candidates, MIN_APART * side_m)

        if len(chosen) == BUILDINGS:
            return chosen

    return None


def _apart(buildings_m: Points, candidates: Sequence[int], min_m: float) -> list[int]:
    """Return the first BUILDINGS of `candidates` that lie `min_m` from each other, or fewer."""
    chosen: list[int] = []

    for candidate in candidates:
        offsets_m = buildings_m[chosen] - buildings_m[candidate]
        distances_m = np.hypot(*offsets_m.T)
        if distances_m.min(initial=np.inf) >= min_m:
            chosen.append(candidate)
        if len(chosen) == BUILDINGS:
            break

    return chosen


def _tour(streets: Streets, buildings_m: Points) -> tuple[list[int], list[Points]]:
    """Return the order of the shortest tour past (n, 2) buildings, and its line from each to the
    next.
    """
    joined, fronts = streets.with_points(buildings_m)
    distances_m, before = joined.shortest_paths(fronts)

    _, order = shortest_tour(distances_m[:, fronts])
    closed = [*order, order[0]]
    legs_m = []

    for start, end in itertools.pairwise(closed):
        front = int(fronts[end])
        points = shortest_path(before[start], front)
        legs_m.append(joined.points_m[points])

    return order, legs_m


def _joined(lines: Sequence[Points]) -> Points:
    """Join lines into one, without points that coincide with the one before."""
    points_m = np.vstack(lines)
    lengths_m = _step_lengths_m(points_m)
    is_step = lengths_m > SAME_POINT_M
    is_new = np.insert(is_step, 0, True)
    return np.asarray(points_m[is_new])


def _beginning(line_m: Points, length_m: float) -> Points:
    """Return the first `length_m` of a line."""
    along_m = distances_along(line_m)
    before_m = line_m[along_m < length_m]
    end_m = interpolate(along_m, line_m, np.array([length_m]))
    return np.vstack([before_m, end_m])


def _step_lengths_m(line_m: Points) -> Points:
    """Return the distance from each of the (n, 2) points of a line to the next, (n - 1,)."""
    steps_m = np.diff(line_m, axis=0)
    return np.asarray(np.hypot(*steps_m.T))
