"""A town from a seed: a loop of streets with buildings along it. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from cogmap.geometry.se2 import transform_to
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.catalogue import CATALOGUE, BuildingType
from cogmap.services.sim.layout.furniture import furnish
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import (
    PAVEMENT_WIDTH_M,
    STREET_WIDTH_M,
    Plot,
    Point,
    Rectangle,
    Road,
    overlap,
)

MIN_BUILDINGS = 21
CANDIDATES = 6
STREET_GAP_M = 0.2
BUILDING_GAP_M = 1.0
_REACH_M = STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M


@dataclass(frozen=True)
class Town(Place):
    """Streets on a rectangular loop with stubs, and what stands along them.

    A lap leads from `start` past the `corners` in order.
    """

    corners: tuple[Point, Point, Point, Point]

    @property
    def lap_m(self) -> float:
        """The length of one lap along the centre lines."""
        closed = (self.corners[-1], *self.corners)
        lengths_m = [math.dist(a, b) for a, b in pairwise(closed)]

        return sum(lengths_m)

    def goals(self, laps: float = 1.0) -> list[Point]:
        """The corners that are passed in `laps` laps, and the place where they end, in order, in
        the frame of the start.
        """
        points = np.array(self.line(laps)[1:])
        start = np.array([self.start.x_m, self.start.y_m, self.start.heading_rad])
        return [(x_m, y_m) for x_m, y_m in transform_to(start, points).tolist()]

    def line(self, laps: float = 1.0) -> list[Point]:
        """The start, the corners passed, the end."""
        here = (self.start.x_m, self.start.y_m)
        points: list[Point] = [here]
        left_m = laps * self.lap_m
        while True:
            corner = self.corners[(len(points) - 1) % 4]
            length_m = math.dist(here, corner)
            if left_m <= length_m:
                points.append(_between(here, corner, left_m / length_m))
                return points

            points.append(corner)
            here = corner
            left_m -= length_m


def generate(seed: int, kinds: tuple[BuildingType, ...] = CATALOGUE) -> Town:
    """The town of `seed`: the same every time, with at least MIN_BUILDINGS buildings, none on a
    street or another.

    It has each of `kinds` once at most; there should be some more of them than MIN_BUILDINGS.
    """
    rng = np.random.default_rng([seed, 0x70])
    plots: list[Plot] = []
    while len(plots) < MIN_BUILDINGS:
        half_x_m = float(rng.uniform(23, 28))
        half_y_m = float(rng.uniform(18, 21))
        roads = _roads(rng, half_x_m, half_y_m)
        plots = _settle(rng, roads, kinds)

    start_x_m = float(rng.uniform(-0.7, -0.3)) * half_x_m

    return Town(
        seed=seed,
        roads=tuple(roads),
        plots=tuple(plots),
        props=furnish(seed, roads, plots),
        start=Pose(x_m=start_x_m, y_m=-half_y_m, heading_rad=0.0),
        corners=(
            (half_x_m, -half_y_m),
            (half_x_m, half_y_m),
            (-half_x_m, half_y_m),
            (-half_x_m, -half_y_m),
        ),
    )


def _settle(
    rng: np.random.Generator, roads: list[Road], kinds: tuple[BuildingType, ...]
) -> list[Plot]:
    """Buildings on both sides of the loop."""
    streets = [road.area(_REACH_M) for road in roads]
    settlement = _Settlement(rng, streets, kinds)

    south, east, north, west = roads[:4]
    for road in (south, north, east, west):
        settlement.line(road, left=True)
        settlement.line(road, left=False)

    return settlement.plots


@dataclass
class _Settlement:
    """Buildings in the order of their placement: each kind is built once, and none on a street."""

    rng: np.random.Generator
    streets: list[Rectangle]
    choice: tuple[BuildingType, ...]
    plots: list[Plot] = field(default_factory=list)

    def __post_init__(self) -> None:
        order = self.rng.permutation(len(self.choice))

        self.kinds: list[BuildingType] = [self.choice[i] for i in order]

    def line(self, road: Road, left: bool) -> None:
        """Build along one side of `road` wherever something fits."""
        along_m = -_REACH_M
        while along_m < road.length_m + _REACH_M:
            plot = self._fitting(road, along_m, left)
            if plot is None:
                along_m += 1.0
                continue

            self.plots.append(plot)
            self.kinds.remove(plot.kind)
            gap_m = float(self.rng.uniform(1.2, 4.0))
            along_m += plot.kind.width_m + gap_m

    def _fitting(self, road: Road, along_m: float, left: bool) -> Plot | None:
        """The first of the next kinds that fits `along_m` from the road's start."""
        for kind in self.kinds[:CANDIDATES]:
            plot = self._plot(kind, road, along_m, left)
            end_m = along_m + kind.width_m
            if end_m < road.length_m + _REACH_M and self._is_free(plot.footprint):
                return plot

        return None

    def _plot(self, kind: BuildingType, road: Road, along_m: float, left: bool) -> Plot:
        # A front looks to the right of its heading: to the road.
        turn_rad = 0.0 if left else math.pi
        heading_rad = math.remainder(road.heading_rad + turn_rad, math.tau)

        garden_m = float(self.rng.uniform(0.3, 2.0))
        back_m = _REACH_M + garden_m + kind.depth_m / 2
        left_m = back_m if left else -back_m

        middle_m = along_m + kind.width_m / 2
        x_m, y_m = road.point(middle_m, left_m)
        return Plot(kind, round(x_m, 3), round(y_m, 3), heading_rad)

    def _is_free(self, area: Rectangle) -> bool:
        if any(overlap(area, street, STREET_GAP_M) for street in self.streets):
            return False

        footprints = [plot.footprint for plot in self.plots]

        return not any(overlap(area, other, BUILDING_GAP_M) for other in footprints)


def _roads(rng: np.random.Generator, half_x_m: float, half_y_m: float) -> list[Road]:
    """The four streets of the loop, and two stubs at opposite corners."""
    south_west = (-half_x_m, -half_y_m)
    south_east = (half_x_m, -half_y_m)
    north_east = (half_x_m, half_y_m)
    north_west = (-half_x_m, half_y_m)

    east, north = rng.choice([-1.0, 1.0], 2).tolist()
    stub_m = float(rng.uniform(14, 20))

    corner = (east * half_x_m, north * half_y_m)
    station = (corner[0] + east * stub_m, corner[1])

    opposite = (-east * half_x_m, -north * half_y_m)
    mill = (opposite[0], opposite[1] - north * stub_m)

    return [
        Road("South Street", south_west, south_east),
        Road("East Street", south_east, north_east),
        Road("North Street", north_east, north_west),
        Road("West Street", north_west, south_west),
        Road("Station Road", corner, station),
        Road("Mill Lane", opposite, mill),
    ]


def _between(a: Point, b: Point, share: float) -> Point:
    a_x, a_y = a
    b_x, b_y = b
    x = a_x + share * (b_x - a_x)
    y = a_y + share * (b_y - a_y)

    return x, y
