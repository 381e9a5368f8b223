"""A town from a seed: a loop of streets with buildings along it. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from schemas.sensing import Building, Pose, Street, TrueTown
from services.sim.catalogue import CATALOGUE, BuildingType

STREET_WIDTH_M = 8.0
PAVEMENT_WIDTH_M = 2.0
MIN_BUILDINGS = 20
_REACH_M = STREET_WIDTH_M / 2 + PAVEMENT_WIDTH_M

Point = tuple[float, float]
Rectangle = tuple[float, float, float, float]
Leg = tuple[float, float]


@dataclass(frozen=True)
class Plot:
    """A building where it stands. Its front looks to the right of `heading_rad`; that heading runs along its width."""

    kind: BuildingType
    x_m: float
    y_m: float
    heading_rad: float

    @property
    def footprint(self) -> Rectangle:
        """West, south, east, north in metres."""
        along, across = self.kind.width_m / 2, self.kind.depth_m / 2
        half_x, half_y = (across, along) if abs(math.sin(self.heading_rad)) > 0.5 else (along, across)
        return self.x_m - half_x, self.y_m - half_y, self.x_m + half_x, self.y_m + half_y


@dataclass(frozen=True)
class Road:
    """A straight street along x or y: its centre line from `start` to `end`."""

    name: str
    start: Point
    end: Point

    def area(self, reach_m: float) -> Rectangle:
        """West, south, east, north of what lies within `reach_m` of the centre line, ends squared off."""
        (ax, ay), (bx, by) = self.start, self.end
        return min(ax, bx) - reach_m, min(ay, by) - reach_m, max(ax, bx) + reach_m, max(ay, by) + reach_m


@dataclass(frozen=True)
class Town:
    """Streets on a rectangular loop with stubs, and buildings; the robot starts at `start` and drives `corners` in order."""

    seed: int
    roads: tuple[Road, ...]
    plots: tuple[Plot, ...]
    start: Pose
    corners: tuple[Point, ...]

    def route(self, laps: float = 1.0) -> list[Leg]:
        """The legs (length_m, turn_rad at its end, left positive) of `laps` laps from the start; the last turn is 0."""
        left_m = laps * self.lap_m
        here, heading, number = (self.start.x_m, self.start.y_m), self.start.heading_rad, 0
        legs: list[Leg] = []
        while left_m > 1e-9:
            corner, after = self.corners[number % 4], self.corners[(number + 1) % 4]
            length_m, next_heading = math.dist(here, corner), math.atan2(after[1] - corner[1], after[0] - corner[0])
            if left_m <= length_m:
                legs.append((left_m, 0.0))
                break
            legs.append((length_m, math.remainder(next_heading - heading, math.tau)))
            left_m, here, heading, number = left_m - length_m, corner, next_heading, number + 1
        return legs

    @property
    def lap_m(self) -> float:
        """The length of one lap along the centre lines."""
        return sum(math.dist(a, b) for a, b in zip(self.corners, self.corners[1:] + self.corners[:1], strict=True))

    def message(self) -> TrueTown:
        """The town as it travels."""
        return TrueTown(
            seed=self.seed,
            streets=[Street(name=r.name, line_m=[r.start, r.end], width_m=STREET_WIDTH_M) for r in self.roads],
            buildings=[
                Building(
                    name=plot.kind.name,
                    pose=Pose(x_m=plot.x_m, y_m=plot.y_m, heading_rad=plot.heading_rad),
                    width_m=plot.kind.width_m,
                    depth_m=plot.kind.depth_m,
                    height_m=plot.kind.height_m,
                )
                for plot in self.plots
            ],
        )


def generate(seed: int) -> Town:
    """The town of `seed`: the same every time, with at least MIN_BUILDINGS buildings, none on a street or another."""
    rng = np.random.default_rng([seed, 0x70])
    for _ in range(1000):
        half_x, half_y = float(rng.uniform(23, 28)), float(rng.uniform(18, 21))
        roads = _roads(rng, half_x, half_y)
        plots = _settle(rng, roads, half_x, half_y)
        if len(plots) >= MIN_BUILDINGS:
            break
    else:
        raise AssertionError(f"no town for seed {seed}")
    corners = [(half_x, -half_y), (half_x, half_y), (-half_x, half_y), (-half_x, -half_y)]
    start = Pose(x_m=float(rng.uniform(-0.7, -0.3)) * half_x, y_m=-half_y, heading_rad=0.0)
    return Town(seed, tuple(roads), tuple(plots), start, tuple(corners))


def _roads(rng: np.random.Generator, half_x: float, half_y: float) -> list[Road]:
    roads = [
        Road("South Street", (-half_x, -half_y), (half_x, -half_y)),
        Road("East Street", (half_x, -half_y), (half_x, half_y)),
        Road("North Street", (half_x, half_y), (-half_x, half_y)),
        Road("West Street", (-half_x, half_y), (-half_x, -half_y)),
    ]
    east, north = rng.choice([-1.0, 1.0], 2)
    stub_m = float(rng.uniform(14, 20))
    roads.append(Road("Station Road", (east * half_x, north * half_y), (east * (half_x + stub_m), north * half_y)))
    roads.append(Road("Mill Lane", (-east * half_x, -north * half_y), (-east * half_x, -north * (half_y + stub_m))))
    return roads


def _overlap(a: Rectangle, b: Rectangle, gap_m: float) -> bool:
    return a[0] < b[2] + gap_m and b[0] < a[2] + gap_m and a[1] < b[3] + gap_m and b[1] < a[3] + gap_m


def _settle(rng: np.random.Generator, roads: list[Road], half_x: float, half_y: float) -> list[Plot]:
    """Go along both sides of each street of the loop and put a building wherever one fits."""
    areas = [road.area(_REACH_M) for road in roads]
    kinds = [CATALOGUE[i] for i in rng.permutation(len(CATALOGUE))]
    plots: list[Plot] = []
    for road in (roads[0], roads[2], roads[1], roads[3]):
        for outer in (False, True):
            _line(rng, road, outer, kinds, plots, areas)
    return plots


def _line(
    rng: np.random.Generator, road: Road, outer: bool, kinds: list[BuildingType], plots: list[Plot], areas: list[Rectangle]
) -> None:
    heading = math.atan2(road.end[1] - road.start[1], road.end[0] - road.start[0])
    along = (math.cos(heading), math.sin(heading))
    # The loop runs counter-clockwise, so outside is to the right of each street and a front there looks left.
    sideways = (along[1], -along[0]) if outer else (-along[1], along[0])
    facing = heading + math.pi if outer else heading
    s, end_m = -_REACH_M, math.dist(road.start, road.end) + _REACH_M
    while s < end_m and kinds:
        placed = False
        for kind in kinds[:6]:
            set_back = _REACH_M + float(rng.uniform(0.3, 2.0)) + kind.depth_m / 2
            middle = s + kind.width_m / 2
            x = road.start[0] + middle * along[0] + set_back * sideways[0]
            y = road.start[1] + middle * along[1] + set_back * sideways[1]
            plot = Plot(kind, round(x, 3), round(y, 3), math.remainder(facing, math.tau))
            taken = [(area, 0.2) for area in areas] + [(other.footprint, 1.0) for other in plots]
            if middle + kind.width_m / 2 <= end_m and not any(_overlap(plot.footprint, area, gap) for area, gap in taken):
                plots.append(plot)
                kinds.remove(kind)
                s += kind.width_m + float(rng.uniform(1.2, 4.0))
                placed = True
                break
        if not placed:
            s += 1.0
