"""The parts of a ground plan: roads, in a town along x or y, and buildings that front them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cogmap.services.sim.layout.catalogue import BuildingType

# As wide as a `tertiary` road of OpenStreetMap, and a made-up pavement on each side.
STREET_WIDTH_M = 8.0
PAVEMENT_WIDTH_M = 2.0
# Least gaps from a building to a pavement, and to another building.
STREET_GAP_M = 0.2
BUILDING_GAP_M = 1.0
# Less than this aside, a road runs along an axis: above the rounding of coordinates.
LEVEL_M = 1e-6

Point = tuple[float, float]
Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True)
class Road:
    """A straight street: its centre line from `start` to `end`, and the width between its kerbs."""

    name: str
    start: Point
    end: Point
    width_m: float = STREET_WIDTH_M

    @property
    def length_m(self) -> float:
        """Return the distance from end to end."""
        return math.dist(self.start, self.end)

    @property
    def extent_m(self) -> Point:
        """Return x and y from start to end."""
        start_x, start_y = self.start
        end_x, end_y = self.end

        dx_m = end_x - start_x
        dy_m = end_y - start_y
        return dx_m, dy_m

    @property
    def heading_rad(self) -> float:
        """Return the direction from start to end, counter-clockwise from x."""
        dx_m, dy_m = self.extent_m

        return math.atan2(dy_m, dx_m)

    @property
    def middle(self) -> Point:
        """Return the middle of the centre line."""
        return self.point(self.length_m / 2)

    @property
    def kerbs(self) -> Rectangle:
        """Return west, south, east, north of the road's surface, if it runs along x or y."""
        return self.area(self.width_m / 2)

    @property
    def is_along_an_axis(self) -> bool:
        """Return whether it runs along x or y."""
        dx_m, dy_m = self.extent_m
        return min(abs(dx_m), abs(dy_m)) < LEVEL_M

    def point(self, along_m: float, left_m: float = 0.0) -> Point:
        """Return the point `along_m` from the start, `left_m` to the left of the centre line."""
        start_x, start_y = self.start
        heading_rad = self.heading_rad
        cos = math.cos(heading_rad)
        sin = math.sin(heading_rad)

        x_m = start_x + along_m * cos - left_m * sin
        y_m = start_y + along_m * sin + left_m * cos

        return x_m, y_m

    def area(self, reach_m: float) -> Rectangle:
        """Return west, south, east, north of a road along x or y, within `reach_m` of the centre
        line, ends squared off.
        """
        start_x, start_y = self.start
        end_x, end_y = self.end

        west = min(start_x, end_x) - reach_m
        south = min(start_y, end_y) - reach_m
        east = max(start_x, end_x) + reach_m
        north = max(start_y, end_y) + reach_m

        return west, south, east, north


@dataclass(frozen=True)
class Plot:
    """A building where it stands. Its front looks to the right of `heading_rad`; that heading runs
    along its width. `function` is what it is used for.

    One that is no rectangle has an `outline`, its corners counter-clockwise, within the rectangle
    of its kind's width and depth.
    """

    kind: BuildingType
    x_m: float
    y_m: float
    heading_rad: float
    district: str = ""
    function: str = ""
    outline: tuple[Point, ...] = ()

    @property
    def footprint(self) -> Rectangle:
        """Return the building's west, south, east, north in metres."""
        if self.outline:
            x_m, y_m = zip(*self.outline, strict=True)
            return min(x_m), min(y_m), max(x_m), max(y_m)

        half_x_m = self.kind.width_m / 2
        half_y_m = self.kind.depth_m / 2
        is_along_y = abs(math.sin(self.heading_rad)) > 0.5
        if is_along_y:
            half_x_m, half_y_m = half_y_m, half_x_m

        west = self.x_m - half_x_m
        south = self.y_m - half_y_m
        east = self.x_m + half_x_m
        north = self.y_m + half_y_m

        return west, south, east, north

    @property
    def corners(self) -> tuple[Point, ...]:
        """Return the corners of its walls, counter-clockwise."""
        if self.outline:
            return self.outline

        size_m = (self.kind.width_m, self.kind.depth_m)
        return corners((self.x_m, self.y_m), self.heading_rad, size_m)


def corners(middle: Point, heading_rad: float, size_m: Point) -> tuple[Point, Point, Point, Point]:
    """Return a rectangle's corners, counter-clockwise; `size_m`: along its heading, and across."""
    x_m, y_m = middle
    length_m, width_m = size_m
    cos = math.cos(heading_rad)
    sin = math.sin(heading_rad)

    ahead_x = cos * length_m / 2
    ahead_y = sin * length_m / 2
    left_x = -sin * width_m / 2
    left_y = cos * width_m / 2

    rear_right = (x_m - ahead_x - left_x, y_m - ahead_y - left_y)
    front_right = (x_m + ahead_x - left_x, y_m + ahead_y - left_y)
    front_left = (x_m + ahead_x + left_x, y_m + ahead_y + left_y)
    rear_left = (x_m - ahead_x + left_x, y_m - ahead_y + left_y)
    return rear_right, front_right, front_left, rear_left


def overlap(a: Rectangle, b: Rectangle, gap_m: float = 0.0) -> bool:
    """Decide whether the rectangles come closer than `gap_m`."""
    a_west, a_south, a_east, a_north = a
    b_west, b_south, b_east, b_north = b

    a_begins_in_x = a_west < b_east + gap_m
    b_begins_in_x = b_west < a_east + gap_m
    a_begins_in_y = a_south < b_north + gap_m
    b_begins_in_y = b_south < a_north + gap_m
    return a_begins_in_x and b_begins_in_x and a_begins_in_y and b_begins_in_y
