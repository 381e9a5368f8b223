"""A town from a seed: a loop of streets with buildings along it. Pure."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from schemas.sensing import Building, Pose, Street, TrueTown
from services.sim.layout.catalogue import CATALOGUE, BuildingType
from services.sim.layout.furniture import Prop, furnish
from services.sim.layout.plan import (
    PAVEMENT_WIDTH_M,
    STREET_WIDTH_M,
    Plot,
    Point,
    Rectangle,
    Road,
    overlap,
)

MIN_BUILDINGS = 21
_REACH_M = STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M
_CHOICE = 6

Leg = tuple[float, float]


@dataclass(frozen=True)
class Place:
    """Streets, buildings, and props such as trees, and where the robot begins."""

    seed: int
    roads: tuple[Road, ...]
    plots: tuple[Plot, ...]
    props: tuple[Prop, ...]
    start: Pose

    def message(self) -> TrueTown:
        """The place as it travels."""
        streets = [
            Street(name=r.name, line_m=[r.start, r.end], width_m=STREET_WIDTH_M) for r in self.roads
        ]
        return TrueTown(
            seed=self.seed, streets=streets, buildings=[_building(plot) for plot in self.plots]
        )


@dataclass(frozen=True)
class Town(Place):
    """Streets on a rectangular loop with stubs, and what stands along them.

    The way leads from `start` to the `corners` in order.
    """

    corners: tuple[Point, Point, Point, Point]

    @property
    def lap_m(self) -> float:
        """The length of one lap along the centre lines."""
        return sum(math.dist(self.corners[i - 1], self.corners[i]) for i in range(4))

    def route(self, laps: float = 1.0) -> list[Leg]:
        """The legs (length_m, turn_rad at its end, left positive) of `laps` laps from the start;
        the last turn is 0.
        """
        points = self.line(laps)
        headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in itertools.pairwise(points)]
        turns = [math.remainder(b - a, math.tau) for a, b in itertools.pairwise(headings)]
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(points)]
        return list(zip(lengths, [*turns, 0.0], strict=True))

    def line(self, laps: float = 1.0) -> list[Point]:
        """The points between the route's legs: the start, the corners passed, the end."""
        points: list[Point] = [(self.start.x_m, self.start.y_m)]
        left_m = laps * self.lap_m
        while True:
            corner = self.corners[(len(points) - 1) % 4]
            length_m = math.dist(points[-1], corner)
            if left_m <= length_m:
                points.append(_between(points[-1], corner, left_m / length_m))
                return points
            points.append(corner)
            left_m -= length_m


def generate(seed: int, kinds: tuple[BuildingType, ...] = CATALOGUE) -> Town:
    """The town of `seed`: the same every time, with at least MIN_BUILDINGS buildings, none on a
    street or another.

    It has each of `kinds` once at most; there should be some more of them than MIN_BUILDINGS.
    """
    rng = np.random.default_rng([seed, 0x70])
    plots: list[Plot] = []
    while len(plots) < MIN_BUILDINGS:
        half_x = float(rng.uniform(23, 28))
        half_y = float(rng.uniform(18, 21))
        roads = _roads(rng, half_x, half_y)
        settlement = _Settlement(rng, [road.area(_REACH_M) for road in roads], kinds)
        for road in (roads[0], roads[2], roads[1], roads[3]):
            settlement.line(road, left=True)
            settlement.line(road, left=False)
        plots = settlement.plots
    start = Pose(x_m=float(rng.uniform(-0.7, -0.3)) * half_x, y_m=-half_y, heading_rad=0.0)
    corners = ((half_x, -half_y), (half_x, half_y), (-half_x, half_y), (-half_x, -half_y))
    return Town(seed, tuple(roads), tuple(plots), furnish(seed, roads, plots), start, corners)


@dataclass
class _Settlement:
    """Buildings as they come: each kind is built once, and none on a street."""

    rng: np.random.Generator
    streets: list[Rectangle]
    choice: tuple[BuildingType, ...]
    plots: list[Plot] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.kinds: list[BuildingType] = [
            self.choice[i] for i in self.rng.permutation(len(self.choice))
        ]

    def line(self, road: Road, left: bool) -> None:
        """Go along one side of `road` and build wherever something fits."""
        along_m = -_REACH_M
        while along_m < road.length_m + _REACH_M:
            plot = self._fitting(road, along_m, left)
            if plot is None:
                along_m += 1.0
                continue
            self.plots.append(plot)
            self.kinds.remove(plot.kind)
            along_m += plot.kind.width_m + float(self.rng.uniform(1.2, 4.0))

    def _fitting(self, road: Road, along_m: float, left: bool) -> Plot | None:
        # A front looks to the right of its heading: to the road.
        heading_rad = math.remainder(road.heading_rad + (0.0 if left else math.pi), math.tau)
        for kind in self.kinds[:_CHOICE]:
            back_m = _REACH_M + float(self.rng.uniform(0.3, 2.0)) + kind.depth_m / 2
            x, y = road.point(along_m + kind.width_m / 2, back_m if left else -back_m)
            plot = Plot(kind, round(x, 3), round(y, 3), heading_rad)
            if along_m + kind.width_m < road.length_m + _REACH_M and self._is_free(plot.footprint):
                return plot
        return None

    def _is_free(self, area: Rectangle) -> bool:
        on_street = any(overlap(area, street, 0.2) for street in self.streets)
        return not on_street and not any(overlap(area, plot.footprint, 1.0) for plot in self.plots)


def _roads(rng: np.random.Generator, half_x: float, half_y: float) -> list[Road]:
    east, north = rng.choice([-1.0, 1.0], 2).tolist()
    stub_m = float(rng.uniform(14, 20))
    corner = (east * half_x, north * half_y)
    opposite = (-east * half_x, -north * half_y)
    return [
        Road("South Street", (-half_x, -half_y), (half_x, -half_y)),
        Road("East Street", (half_x, -half_y), (half_x, half_y)),
        Road("North Street", (half_x, half_y), (-half_x, half_y)),
        Road("West Street", (-half_x, half_y), (-half_x, -half_y)),
        Road("Station Road", corner, (corner[0] + east * stub_m, corner[1])),
        Road("Mill Lane", opposite, (opposite[0], opposite[1] - north * stub_m)),
    ]


def _between(a: Point, b: Point, share: float) -> Point:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def _building(plot: Plot) -> Building:
    return Building(
        name=plot.kind.name,
        pose=Pose(x_m=plot.x_m, y_m=plot.y_m, heading_rad=plot.heading_rad),
        width_m=plot.kind.width_m,
        depth_m=plot.kind.depth_m,
        height_m=plot.kind.height_m,
    )
