"""What a ground plan is made of: roads, in a town along x or y, and buildings that front them.
Pure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from services.sim.layout.catalogue import BuildingType

STREET_WIDTH_M = 8.0
PAVEMENT_WIDTH_M = 2.0
LEVEL_M = 1e-6

Point = tuple[float, float]
Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True)
class Road:
    """A straight street: its centre line from `start` to `end`."""

    name: str
    start: Point
    end: Point

    @property
    def length_m(self) -> float:
        """From end to end."""
        return math.dist(self.start, self.end)

    @property
    def heading_rad(self) -> float:
        """From start to end, counter-clockwise from x."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def is_along_an_axis(self) -> bool:
        """Whether it runs along x or y."""
        return min(abs(self.end[0] - self.start[0]), abs(self.end[1] - self.start[1])) < LEVEL_M

    def point(self, along_m: float, left_m: float = 0.0) -> Point:
        """The point `along_m` from the start, `left_m` to the left of the centre line."""
        ux = math.cos(self.heading_rad)
        uy = math.sin(self.heading_rad)
        return self.start[0] + along_m * ux - left_m * uy, self.start[
            1
        ] + along_m * uy + left_m * ux

    def area(self, reach_m: float) -> Rectangle:
        """West, south, east, north of a road along x or y, within `reach_m` of the centre line,
        ends squared off.
        """
        (ax, ay), (bx, by) = self.start, self.end
        return (
            min(ax, bx) - reach_m,
            min(ay, by) - reach_m,
            max(ax, bx) + reach_m,
            max(ay, by) + reach_m,
        )


@dataclass(frozen=True)
class Plot:
    """A building where it stands. Its front looks to the right of `heading_rad`; that heading runs
    along its width.
    """

    kind: BuildingType
    x_m: float
    y_m: float
    heading_rad: float

    @property
    def footprint(self) -> Rectangle:
        """West, south, east, north in metres."""
        along = self.kind.width_m / 2
        across = self.kind.depth_m / 2
        half_x, half_y = (
            (across, along) if abs(math.sin(self.heading_rad)) > 0.5 else (along, across)
        )
        return self.x_m - half_x, self.y_m - half_y, self.x_m + half_x, self.y_m + half_y


def overlap(a: Rectangle, b: Rectangle, gap_m: float = 0.0) -> bool:
    """Whether the rectangles come closer than `gap_m`."""
    return (
        a[0] < b[2] + gap_m and b[0] < a[2] + gap_m and a[1] < b[3] + gap_m and b[1] < a[3] + gap_m
    )
