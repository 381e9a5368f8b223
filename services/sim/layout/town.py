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
    BUILDING_GAP_M,
    PAVEMENT_WIDTH_M,
    STREET_GAP_M,
    STREET_WIDTH_M,
    Plot,
    Point,
    Rectangle,
    Road,
    overlap,
)

# Of the catalogue's 24 kinds; and how many kinds are tried where one is to be built.
MIN_BUILDINGS = 21
CANDIDATES = 6
_REACH_M = STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M


@dataclass(frozen=True)
class Town(Place):
    """Streets on a rectangular loop with stubs, and what stands along them.

    A lap leads from `start` past the `corners` in order.
    """

    corners: tuple[Point, Point, Point, Point]

    @property
    def lap_m(self) -> float:
        """Return the length of one lap along the centre lines."""
        closed = (self.corners[-1], *self.corners)
        lengths_m = [math.dist(a, b) for a, b in pairwise(closed)]

        return sum(lengths_m)

    def goals(self, laps: float = 1.0) -> list[Point]:
        """Return the corners that are passed in `laps` laps, and the place where they end, in
        order, in the frame of the start.
        """
        points = np.array(self.line(laps)[1:])
        start = np.array([self.start.x_m, self.start.y_m, self.start.heading_rad])
        return [(x_m, y_m) for x_m, y_m in transform_to(start, points).tolist()]

    def line(self, laps: float = 1.0) -> list[Point]:
        """Return the start, the corners passed, the end."""
        here = (self.start.x_m, self.start.y_m)
        points: list[Point] = [here]
        left_m = laps * self.lap_m
        while True:
            corner = self.corners[(len(points) - 1) % 4]
            length_m = math.dist(here, corner)
            if left_m <= length_m:
                share = left_m / length_m
                here_x, here_y = here
                end_x = here_x + share * (corner[0] - here_x)
                end_y = here_y + share * (corner[1] - here_y)
                return [*points, (end_x, end_y)]

            points.append(corner)
            here = corner
            left_m -= length_m


def generate(seed: int, kinds: tuple[BuildingType, ...] = CATALOGUE) -> Town:
    """Make the town of `seed`: the same every time, with at least MIN_BUILDINGS buildings, none on
    a street or another building.

    It has each of `kinds` once at most; there should be some more of them than MIN_BUILDINGS.
    """
    rng = np.random.default_rng([seed, 0x70])
    plots: list[Plot] = []
    while len(plots) < MIN_BUILDINGS:
        half_x_m = float(rng.uniform(23, 28))
        half_y_m = float(rng.uniform(18, 21))
        roads = _roads(rng, half_x_m, half_y_m)
        settlement = _Settlement(rng, [road.area(_REACH_M) for road in roads], kinds)
        south, east, north, west = roads[:4]
        for road in (south, north, east, west):
            settlement.line(road, left=True)
            settlement.line(road, left=False)
        plots = settlement.plots

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
        """Return the first of the next kinds that fits `along_m` from the road's start."""
        # A front looks to the right of its heading: to the road.
        turn_rad = 0.0 if left else math.pi
        heading_rad = math.remainder(road.heading_rad + turn_rad, math.tau)
        footprints = [plot.footprint for plot in self.plots]

        for kind in self.kinds[:CANDIDATES]:
            garden_m = float(self.rng.uniform(0.3, 2.0))
            back_m = _REACH_M + garden_m + kind.depth_m / 2
            x_m, y_m = road.point(along_m + kind.width_m / 2, back_m if left else -back_m)
            plot = Plot(kind, round(x_m, 3), round(y_m, 3), heading_rad)
            if along_m + kind.width_m >= road.length_m + _REACH_M:
                continue

            area = plot.footprint
            meets_street = any(overlap(area, street, STREET_GAP_M) for street in self.streets)
            if meets_street or any(overlap(area, other, BUILDING_GAP_M) for other in footprints):
                continue
            return plot

        return None


def _roads(rng: np.random.Generator, half_x_m: float, half_y_m: float) -> list[Road]:
    """Make the four streets of the loop, and two stubs at opposite corners."""
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
