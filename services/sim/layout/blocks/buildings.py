"""The buildings of a town of several blocks: along both sides of its streets, none on a street or
another. Pure.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.services.sim.layout.blocks.districts import Builder, Districts, function_of
from cogmap.services.sim.layout.catalogue import BuildingType
from cogmap.services.sim.layout.plan import (
    BUILDING_GAP_M,
    PAVEMENT_WIDTH_M,
    STREET_GAP_M,
    Plot,
    Rectangle,
    Road,
)

# Between the places along a street that are tried.
STEP_M = 1.5
GARDEN_M = (0.3, 1.5)
BETWEEN_M = (1.2, 3.5)
# Buildings of a district that wait for a place where they fit; shorter streets get none.
CANDIDATES = 3
MIN_LENGTH_M = 12.0


def settle(
    rng: np.random.Generator, roads: tuple[Road, ...], districts: Districts
) -> tuple[Plot, ...]:
    """Place buildings wherever one fits along the roads."""
    settlement = _Settlement(rng, roads, districts)
    for road in roads:
        if road.length_m >= MIN_LENGTH_M:
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

            self.plots.append(plot)
            self._waiting[plot.district].remove(plot.kind)
            area = np.array([_grown(plot.footprint, BUILDING_GAP_M)])
            self._occupied = np.vstack([self._occupied, area])

            gap_m = float(self._rng.uniform(*BETWEEN_M))
            along_m += plot.kind.width_m + gap_m

    def _fitting(self, road: Road, along_m: float, left: bool) -> Plot | None:
        """Return the first of the district's next kinds that fits `along_m` from the road's start,
        on one side of it.
        """
        side_m = road.width_m if left else -road.width_m
        district = self._districts.at(*road.point(along_m, side_m))
        garden_m = float(self._rng.uniform(*GARDEN_M))
        # A front looks to the right of its heading: to the road.
        turn_rad = 0.0 if left else math.pi
        heading_rad = math.remainder(road.heading_rad + turn_rad, math.tau)

        waiting = self._waiting.setdefault(district.name, [])
        while len(waiting) < CANDIDATES:
            waiting.append(self._builder.next(district))

        for kind in waiting:
            back_m = road.width_m / 2 + PAVEMENT_WIDTH_M + garden_m + kind.depth_m / 2
            x_m, y_m = road.point(along_m + kind.width_m / 2, back_m if left else -back_m)
            plot = Plot(
                kind=kind,
                x_m=round(x_m, 3),
                y_m=round(y_m, 3),
                heading_rad=heading_rad,
                district=district.name,
                function=function_of(kind),
            )

            west, south, east, north = plot.footprint
            others_west, others_south, others_east, others_north = self._occupied.T
            overlaps_in_x = (west < others_east) & (others_west < east)
            overlaps_in_y = (south < others_north) & (others_south < north)
            if not (overlaps_in_x & overlaps_in_y).any():
                return plot

        return None


def _grown(area: Rectangle, gap_m: float) -> Rectangle:
    west, south, east, north = area
    return west - gap_m, south - gap_m, east + gap_m, north + gap_m
