"""The buildings of a town of several blocks: along both sides of its streets, none on a street or
another. Pure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.services.sim.layout.blocks.districts import Builder, District, Districts, function_of
from cogmap.services.sim.layout.catalogue import BuildingType
from cogmap.services.sim.layout.plan import PAVEMENT_WIDTH_M, Plot, Rectangle, Road

STREET_GAP_M = 0.2
BUILDING_GAP_M = 1.0
STEP_M = 1.5
GARDEN_M = (0.3, 1.5)
BETWEEN_M = (1.2, 3.5)
CANDIDATES = 3
SHORTEST_M = 12.0


class Front(NamedTuple):
    """Where a building begins along a road, on which side, and how far behind the pavement."""

    road: Road
    along_m: float
    left: bool
    garden_m: float


def settle(
    rng: np.random.Generator, roads: tuple[Road, ...], districts: Districts
) -> tuple[Plot, ...]:
    """Buildings wherever one fits along the roads."""
    settlement = _Settlement(rng, roads, districts)
    for road in roads:
        if road.length_m >= SHORTEST_M:
            settlement.line(road, left=True)
            settlement.line(road, left=False)

    return tuple(settlement.plots)


class _Settlement:
    """Buildings in the order of their placement; `_waiting` are those of each district that found
    no room yet.
    """

    def __init__(
        self, rng: np.random.Generator, roads: tuple[Road, ...], districts: Districts
    ) -> None:
        self.plots: list[Plot] = []
        self._rng = rng
        self._districts = districts
        self._builder = Builder(rng)
        self._waiting: dict[str, list[BuildingType]] = {}

        streets = [road.area(road.width_m / 2 + PAVEMENT_WIDTH_M) for road in roads]
        self._occupied = np.array([_grown(street, STREET_GAP_M) for street in streets])

    def line(self, road: Road, left: bool) -> None:
        """Build along one side of a road."""
        along_m = 0.0
        while along_m < road.length_m:
            plot = self._fitting(road, along_m, left)
            if plot is None:
                along_m += STEP_M
                continue

            self._build(plot)
            gap_m = float(self._rng.uniform(*BETWEEN_M))
            along_m += plot.kind.width_m + gap_m

    def _build(self, plot: Plot) -> None:
        self.plots.append(plot)
        self._waiting[plot.district].remove(plot.kind)

        area = np.array([_grown(plot.footprint, BUILDING_GAP_M)])
        self._occupied = np.vstack([self._occupied, area])

    def _fitting(self, road: Road, along_m: float, left: bool) -> Plot | None:
        """The first of the district's next kinds that fits `along_m` from the road's start."""
        side_m = road.width_m if left else -road.width_m
        district = self._districts.at(*road.point(along_m, side_m))
        front = Front(road, along_m, left, float(self._rng.uniform(*GARDEN_M)))

        for kind in self._candidates(district):
            plot = _plot(kind, district, front)
            if self._is_free(plot.footprint):
                return plot

        return None

    def _candidates(self, district: District) -> list[BuildingType]:
        waiting = self._waiting.setdefault(district.name, [])
        while len(waiting) < CANDIDATES:
            waiting.append(self._builder.next(district))

        return waiting

    def _is_free(self, area: Rectangle) -> bool:
        west, south, east, north = area
        others_west, others_south, others_east, others_north = self._occupied.T

        begins_in_x = west < others_east
        ends_in_x = others_west < east
        begins_in_y = south < others_north
        ends_in_y = others_south < north

        overlaps = begins_in_x & ends_in_x & begins_in_y & ends_in_y
        return not bool(overlaps.any())


def _plot(kind: BuildingType, district: District, front: Front) -> Plot:
    road = front.road
    # A front looks to the right of its heading: to the road.
    turn_rad = 0.0 if front.left else math.pi
    heading_rad = math.remainder(road.heading_rad + turn_rad, math.tau)

    back_m = road.width_m / 2 + PAVEMENT_WIDTH_M + front.garden_m + kind.depth_m / 2
    left_m = back_m if front.left else -back_m
    x_m, y_m = road.point(front.along_m + kind.width_m / 2, left_m)

    return Plot(
        kind=kind,
        x_m=round(x_m, 3),
        y_m=round(y_m, 3),
        heading_rad=heading_rad,
        district=district.name,
        function=function_of(kind),
    )


def _grown(area: Rectangle, gap_m: float) -> Rectangle:
    west, south, east, north = area
    return west - gap_m, south - gap_m, east + gap_m, north + gap_m
