"""Where streets and buildings end, as straight segments (n, 4): x and y of one end, then of the
other. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.sim.layout.plan import Point, Road, corners

CHUNK = 256
"""Sides that are compared with all streets at once: their arrays fit into a processor's cache."""

MIN_LENGTH_M = 1e-3
"""A shorter piece of a kerb is left out: a millimetre, less than any map states."""

_SAME_M = 1e-6
"""Nearer than this, two points are one: above the rounding of coordinates of a large town."""

_LEVEL_M = 1e-9
"""Less than this aside, two lines are parallel: above the rounding of their direction."""


class Surfaces(NamedTuple):
    """The surfaces of n streets: rectangles whose ends reach half a width further than their centre
    lines.
    """

    middle_m: Floats
    ahead: Floats
    half_length_m: Floats
    half_width_m: Floats

    def local(self, points_m: Floats) -> tuple[Floats, Floats]:
        """Return how far (k, 2) points are from each middle, along the street and to its left,
        (k, n) each.
        """
        ahead_x, ahead_y = self.ahead.T
        middle_x_m, middle_y_m = self.middle_m.T
        x_m = points_m[:, :1] - middle_x_m
        y_m = points_m[:, 1:] - middle_y_m

        along_m = x_m * ahead_x + y_m * ahead_y
        left_m = y_m * ahead_x - x_m * ahead_y
        return along_m, left_m

    def chosen(self, numbers: Booleans) -> Surfaces:
        """Select the surfaces of a mask, (n,)."""
        return Surfaces(*(column[numbers] for column in self))


def surfaces(roads: Sequence[Road]) -> Surfaces:
    """Return the surfaces of `roads`."""
    middles = [road.middle for road in roads]
    headings_rad = np.array([road.heading_rad for road in roads])
    lengths_m = np.array([road.length_m for road in roads])
    widths_m = np.array([road.width_m for road in roads])

    return Surfaces(
        middle_m=np.array(middles, float).reshape(-1, 2),
        ahead=np.column_stack([np.cos(headings_rad), np.sin(headings_rad)]),
        half_length_m=(lengths_m + widths_m) / 2,
        half_width_m=widths_m / 2,
    )


def outlines(shapes: Sequence[Sequence[Point]]) -> Floats:
    """Return the (n, 4) sides of polygons, in order."""
    sides = []
    for shape in shapes:
        following = [*shape[1:], shape[0]]
        for start, end in zip(shape, following, strict=True):
            sides.append((*start, *end))

    return np.array(sides, float).reshape(-1, 4)


def points_along(segments_m: Floats, step_m: float) -> Floats:
    """Return (k, 2) points along (n, 4) segments, `step_m` apart at most."""
    starts_m = segments_m[:, :2]
    along_m = segments_m[:, 2:] - starts_m
    lengths_m = np.hypot(along_m[:, 0], along_m[:, 1])

    needed = np.ceil(lengths_m / step_m)
    counts = needed.astype(int).clip(1)
    firsts = np.cumsum(counts) - counts

    # Of each point: the number of its segment, and its place among the points of that one.
    segment = np.repeat(np.arange(len(segments_m)), counts)
    place = np.arange(len(segment)) - firsts[segment]
    share = (place + 0.5) / counts[segment]

    offset_m = share[:, None] * along_m[segment]
    points_m: Floats = starts_m[segment] + offset_m
    return points_m


def clearance_m(segments_m: Floats, x_m: float, y_m: float) -> float:
    """Measure how far a point is from the nearest of (n, 4) segments, infinite if there is none."""
    if not len(segments_m):
        return math.inf

    start_m = segments_m[:, :2]
    along_m = segments_m[:, 2:] - start_m
    to_point_m = (x_m, y_m) - start_m

    length_m2 = (along_m**2).sum(axis=1)
    dot_m2 = (to_point_m * along_m).sum(axis=1)
    share = dot_m2 / np.maximum(length_m2, _SAME_M**2)

    foot_m = share.clip(0.0, 1.0)[:, None] * along_m
    away_m = to_point_m - foot_m
    return float(np.hypot(away_m[:, 0], away_m[:, 1]).min())


def kerbs(roads: Sequence[Road]) -> Floats:
    """Find the (n, 4) outline of all that is the surface of a street: the sides of each street
    without what lies on another.
    """
    if not roads:
        return np.zeros((0, 4))

    sides = outlines([_surface(road) for road in roads])
    streets = surfaces(roads)

    pieces = []
    for first in range(0, len(sides), CHUNK):
        chunk = sides[first : first + CHUNK]
        owners = np.arange(first, first + len(chunk)) // 4
        pieces += _uncovered(chunk, owners, streets)

    return np.array(pieces, float).reshape(-1, 4)


def _surface(road: Road) -> tuple[Point, ...]:
    size_m = (road.length_m + road.width_m, road.width_m)
    return corners(road.middle, road.heading_rad, size_m)


def _uncovered(sides: Floats, owners: Indices, streets: Surfaces) -> list[list[float]]:
    """Find the parts of (k, 4) sides, each of the street `owners`, that lie on no other street.

    Of two sides at the same place, the first street's is kept.
    """
    begins, ends = _covered(sides, owners, streets)

    pieces = []
    for side, starts, stops in zip(sides, begins, ends, strict=True):
        is_covered = stops > starts
        start_m = side[:2]
        along_m = side[2:] - start_m
        shortest = MIN_LENGTH_M / np.hypot(*along_m)

        for begin, end in _gaps(starts[is_covered], stops[is_covered], shortest):
            first_m = start_m + begin * along_m
            last_m = start_m + end * along_m
            pieces.append([*first_m.tolist(), *last_m.tolist()])

    return pieces


def _covered(sides: Floats, owners: Indices, streets: Surfaces) -> tuple[Floats, Floats]:
    """Find from which to which share of its length each side lies on each street, (k, n) each."""
    numbers = np.arange(len(streets.half_width_m))
    owner = owners[:, None]
    wider_m = np.where(numbers < owner, _SAME_M, -_SAME_M)
    half_length_m = streets.half_length_m + wider_m
    half_width_m = streets.half_width_m + wider_m

    start_along_m, start_left_m = streets.local(sides[:, :2])
    end_along_m, end_left_m = streets.local(sides[:, 2:])
    along_begin, along_end = _crossing(start_along_m, end_along_m, half_length_m)
    left_begin, left_end = _crossing(start_left_m, end_left_m, half_width_m)

    begins = np.maximum(along_begin, left_begin).clip(0.0, 1.0)
    ends = np.minimum(along_end, left_end).clip(0.0, 1.0)
    ends[numbers == owner] = 0.0
    return begins, ends


def _crossing(start_m: Floats, end_m: Floats, half_m: Floats) -> tuple[Floats, Floats]:
    """Find from which to which share of the way from `start_m` to `end_m` the distance is `half_m`
    at most, to either side; the second share is lower if it never is.
    """
    change_m = end_m - start_m
    is_level = np.abs(change_m) < _LEVEL_M
    divisor_m = np.where(is_level, 1.0, change_m)

    at_low = (-half_m - start_m) / divisor_m
    at_high = (half_m - start_m) / divisor_m
    begin = np.minimum(at_low, at_high)
    end = np.maximum(at_low, at_high)

    # What runs along is inside from the start to the end, or nowhere.
    is_inside = np.abs(start_m) <= half_m
    reach = np.where(is_inside, math.inf, -math.inf)
    return np.where(is_level, -reach, begin), np.where(is_level, reach, end)


def _gaps(starts: Floats, stops: Floats, shortest: float) -> list[tuple[float, float]]:
    """Find the stretches of 0 to 1, longer than `shortest`, that none of the intervals covers."""
    gaps = []
    reached = 0.0
    for number in np.argsort(starts).tolist():
        start = float(starts[number])
        if start > reached + shortest:
            gaps.append((reached, start))
        reached = max(reached, float(stops[number]))

    if reached < 1.0 - shortest:
        gaps.append((reached, 1.0))

    return gaps
