"""An environment of the experiment: streets, eight buildings, and the shortest tour past all of
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.errors import UsageError
from experiments.city_maps.streets import Points, Streets, backwards
from experiments.city_maps.tour import shortest_tour

BUILDINGS = 8
MOST_KM2 = 4.0
LEAST_SIDE_M = 400.0
MOST_SIDE_M = 1e3 * MOST_KM2**0.5
LEAST_APART = 0.12
FROM_STREET_M = (4.0, 35.0)
TRIES = 400


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
        """Of the rectangle around the buildings."""
        return float(np.prod(np.ptp(self.buildings_m, axis=0))) / 1e6

    @property
    def tour_m(self) -> float:
        """The length of the tour."""
        return sum(float(np.hypot(*np.diff(leg, axis=0).T).sum()) for leg in self.legs_m)

    def line(self, start: int, backward: bool, lead_m: float, overrun_m: float) -> Points:
        """The tour past building `start`, all others and `start` again.

        It begins `lead_m` before `start`, so that one comes up to it, and goes on `overrun_m`
        beyond where it began.
        """
        legs = [self.legs_m[(start + k) % len(self.legs_m)] for k in range(len(self.legs_m))]
        whole = _joined([leg[::-1] for leg in reversed(legs)] if backward else legs)
        lead = _beginning(whole[::-1], lead_m)[::-1]
        return _joined([lead, whole, _beginning(whole, overrun_m)])


def environments(city: City, number: int, seed: int) -> list[Environment]:
    """`number` environments of `city`, from seeds of their own.

    Raises UsageError where the city has no eight buildings that lie far enough apart along its
    streets.
    """
    streets = city.streets.connected()
    _, feet = streets.nearest(city.buildings_m)
    away = np.hypot(*(city.buildings_m - feet).T)
    usable = np.flatnonzero((away >= FROM_STREET_M[0]) & (away <= FROM_STREET_M[1]))
    made = []
    for count in range(number):
        rng = np.random.default_rng([seed, 0xC1, count])
        chosen = _choose(city.buildings_m, usable, rng)
        if chosen is None:
            raise UsageError(
                f"{city.name}: no {BUILDINGS} buildings by its streets that lie far enough apart: give a larger extract"
            )
        name = city.name if number == 1 else f"{city.name} {count + 1}"
        made.append(_environment(name, city, streets, chosen))
    return made


def _choose(
    buildings_m: Points, usable: npt.NDArray[np.intp], rng: np.random.Generator
) -> list[int] | None:
    """Eight buildings in a square of random size at a random place, none too near to another; or
    None.
    """
    if len(usable) < BUILDINGS:
        return None
    extent = np.ptp(buildings_m[usable], axis=0)
    largest = min(MOST_SIDE_M, max(LEAST_SIDE_M, float(extent.max())))
    for _ in range(TRIES):
        side = float(rng.uniform(LEAST_SIDE_M, largest))
        corner = buildings_m[usable].min(axis=0) + rng.uniform(0, 1, 2) * np.maximum(
            extent - side, 0
        )
        inside = usable[
            ((buildings_m[usable] >= corner) & (buildings_m[usable] <= corner + side)).all(axis=1)
        ]
        chosen: list[int] = []
        for candidate in rng.permutation(inside).tolist():
            apart = np.hypot(*(buildings_m[chosen] - buildings_m[candidate]).T)
            if not chosen or apart.min() >= LEAST_APART * side:
                chosen.append(candidate)
            if len(chosen) == BUILDINGS:
                return chosen
    return None


def _environment(name: str, city: City, streets: Streets, chosen: Sequence[int]) -> Environment:
    joined, fronts = streets.with_points(city.buildings_m[chosen])
    distance, before = joined.ways(fronts)
    _, order = shortest_tour(distance[:, fronts])
    legs = [
        joined.points_m[backwards(before[a], int(fronts[b]))]
        for a, b in zip(order, [*order[1:], order[0]], strict=True)
    ]
    where = city.buildings_m[[chosen[place] for place in order]]
    return Environment(
        name, streets, tuple(city.names[chosen[place]] for place in order), where, tuple(legs)
    )


def _joined(lines: Sequence[Points]) -> Points:
    points = np.vstack(lines)
    fresh = np.hypot(*np.diff(points, axis=0).T) > 1e-6
    return np.asarray(points[np.concatenate([[True], fresh])])


def _beginning(line: Points, length_m: float) -> Points:
    """The first `length_m` of a line."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    end = [[float(np.interp(length_m, along, line[:, axis])) for axis in (0, 1)]]
    return np.vstack([line[along < length_m], end])
