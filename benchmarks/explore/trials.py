"""Drives to goals in a town: which goals are fair, which street is closed, what counts as there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import msgspec
import numpy as np

from benchmarks.explore.drivable import Drivable, barrier_m
from cogmap.cli.launch.guide import streets_ahead
from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import nearest_on_line, resample
from cogmap.schemas.sensing import Street, TrueTown
from cogmap.services.codelets.public import boundary

LINE_STEP_M = 1.0
MIN_AWAY_M = 40.0
REACHED_WITHIN_M = 4.0
SLOWEST_M_S = 1.0
GRACE_S = 60.0
SIGHT_M = boundary.REACH_M
"""How far the agent puts on its map what it sees."""

Point = tuple[float, float]


@dataclass
class Trial:
    """A drive from `start_m` to `goal_m`, in the true frame.

    `closes`: whether a street is to be closed once a route is planned; `closed` is that street.
    `driven_m` is None while the goal is not reached; `shortest_m` is the shortest route's length in
    the town as it is then. `unwarned_m` is what an agent would drive that knows the town and takes
    the shortest routes, but sees that a street is closed, or open again, only where its barrier is
    within SIGHT_M.
    """

    start_m: Point
    goal_m: Point
    began_ns: int
    began_travelled_m: float
    closes: bool
    shortest_m: float
    unwarned_m: float
    closed: str = ""
    driven_m: float | None = None

    @property
    def limit_ns(self) -> int:
        """Return the time at which the drive counts as failed."""
        limit_s = GRACE_S + 3 * self.shortest_m / SLOWEST_M_S
        return self.began_ns + round(limit_s * 1e9)

    @property
    def over_shortest(self) -> float:
        """Return the distance driven over that of the shortest route."""
        assert self.driven_m is not None
        return self.driven_m / self.shortest_m

    @property
    def over_unwarned(self) -> float:
        """Return the distance driven over that of an agent that knows the town, but not which
        street was closed or opened, before it sees that.
        """
        assert self.driven_m is not None
        return self.driven_m / self.unwarned_m

    def close(self, closure: Closure) -> None:
        """Note that the street on the way is closed."""
        self.closed = closure.street
        self.shortest_m = closure.shortest_m
        self.unwarned_m = closure.unwarned_m


class Closure(NamedTuple):
    """A street to be closed, and a drive's `shortest_m` and `unwarned_m` then."""

    street: str
    shortest_m: float
    unwarned_m: float


def centre_lines_m(town: TrueTown) -> Floats:
    """Return (n, 2) points of the streets' centre lines, LINE_STEP_M apart."""
    lines = []
    for street in town.streets:
        line_m = np.array(street.line_m, float)
        lines.append(resample(line_m, LINE_STEP_M))

    return np.vstack(lines)


def closed_as(town: TrueTown, street: str) -> TrueTown:
    """Return the town with that street closed too."""
    streets = []
    for each in town.streets:
        is_closed = each.closed or each.name == street
        streets.append(msgspec.structs.replace(each, closed=is_closed))

    return msgspec.structs.replace(town, streets=streets)


def draw_goal(
    rng: np.random.Generator, town: TrueTown, drivable: Drivable, here_m: Point
) -> tuple[Point, float]:
    """Draw a point of the streets that can be reached from `here_m`. Return it, and the length of
    the shortest route to it, at least MIN_AWAY_M.
    """
    lengths_m = drivable.lengths_from(*here_m)
    for point_m in rng.permutation(centre_lines_m(town)):
        x_m, y_m = point_m.tolist()
        length_m = float(lengths_m.ravel()[drivable.cell(x_m, y_m)])
        if drivable.is_on(x_m, y_m) and MIN_AWAY_M <= length_m < math.inf:
            return (x_m, y_m), length_m

    raise ValueError(f"no goal is {MIN_AWAY_M} m from {here_m}")


def believed_m(town: TrueTown, believed: TrueTown, start_m: Point, goal_m: Point) -> float:
    """Return the length of the shortest route in the town as an agent believes it to be; if that
    has none, in the town as it is.
    """
    length_m = Drivable.of(believed).length_m(start_m, goal_m)
    if math.isfinite(length_m):
        return length_m

    return Drivable.of(town).length_m(start_m, goal_m)


def sees_barrier(street: Street, here_m: Floats) -> bool:
    """Decide whether an agent at (2,) `here_m` would see a street's barrier: within SIGHT_M."""
    (foot_m,) = nearest_on_line(barrier_m(street), here_m[None]).foot_m
    return math.dist(foot_m, here_m) <= SIGHT_M


def street_to_close(
    rng: np.random.Generator,
    town: TrueTown,
    route_m: Floats,
    goal_m: Point,
    believed: TrueTown | None = None,
) -> Closure | None:
    """Draw a street ahead that the (n, 2) route passes, without which the goal can still be
    reached; return None if there is none. The goal is not at its barrier, where it could be reached
    from both sides. It is no square, which a barrier through its middle does not close. An unwarned
    agent drives by the town as it is `believed` to be, or else as it is.
    """
    start_x_m, start_y_m = route_m[0].tolist()
    start_m = (start_x_m, start_y_m)
    passed = streets_ahead(town, route_m)
    for number in rng.permutation(len(passed)).tolist():
        street = passed[number].street
        if math.dist(*street.line_m) < street.width_m:
            continue

        (foot_m,) = nearest_on_line(barrier_m(street), np.array([goal_m])).foot_m
        if math.dist(foot_m, goal_m) < REACHED_WITHIN_M:
            continue

        closed = closed_as(town, street.name)
        length_m = Drivable.of(closed).length_m(start_m, goal_m)
        if not math.isfinite(length_m):
            continue

        known = town if believed is None else believed
        if math.isinf(Drivable.of(known).length_m(start_m, goal_m)):
            known = town

        known_m = Drivable.of(known).route_m(start_m, goal_m)
        seen_as = closed_as(known, street.name)
        driven_m = unwarned_m(known_m, barrier_m(street), closed, seen_as)
        return Closure(street.name, length_m, driven_m)

    return None


def unwarned_m(
    known_m: Floats, barrier_ends_m: Floats, closed: TrueTown, believed: TrueTown
) -> float:
    """Return the length of a drive along (n, 2) `known_m` until its barrier (2, 2) is within
    SIGHT_M, and from there by `believed_m`, in the town as it is with that street `closed`.
    """
    feet_m = nearest_on_line(barrier_ends_m, known_m).foot_m
    is_seen = np.hypot(*(known_m - feet_m).T) <= SIGHT_M
    seen_at = int(is_seen.argmax()) if is_seen.any() else len(known_m) - 1

    steps_m = np.diff(known_m[: seen_at + 1], axis=0)
    driven_m = float(np.hypot(*steps_m.T).sum())
    seen_x_m, seen_y_m = known_m[seen_at].tolist()
    goal_x_m, goal_y_m = known_m[-1].tolist()
    seen_m = (seen_x_m, seen_y_m)
    return driven_m + believed_m(closed, believed, seen_m, (goal_x_m, goal_y_m))
