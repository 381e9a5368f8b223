"""Lanes that the agent counts on: where it drove, and where its plan leads along road."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.polylines import distances_along
from cogmap.geometry.se2 import wrap_angle
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.graph.window import ROAD_FROM, Extent
from cogmap.schemas.nodes import PLAN_ID, PathColumn, PlaceColumn, Plan, Self
from cogmap.services.codelets.planning.ground import POSITION

# A lane is straight that turns by no more so far before and behind. At a bend, what stands beyond
# seems to stand across it.
STRAIGHT_M = (4.0, 8.0)
MAX_TURN_RAD = 0.4
# The direction of a route is that from as many places before to as many after.
ROUTE_PLACES = 3
# Beyond the reach of the scan.
ROUTE_AHEAD_M = 60.0


class Lane(NamedTuple):
    """Places of a lane, (n, 2), and its direction at each, (n,)."""

    position_m: Floats
    heading_rad: Floats

    def where(self, is_kept: Booleans) -> Lane:
        """Keep the places for which `is_kept`, (n,), is true."""
        return Lane(self.position_m[is_kept], self.heading_rad[is_kept])


def lanes(agent: Self, graph: Graph) -> list[Lane]:
    """Return the straight parts of the plan's route ahead, where it was seen to be road, and of the
    path that the agent drove.
    """
    path = rows_of(graph.path)
    driven = Lane(path[:, POSITION], path[:, PathColumn.HEADING_RAD])
    driven = driven.where(_is_straight(driven))

    # A plan that is doubtful is to find out whether a street is closed.
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None or plan.doubtful or plan.map != agent.map:
        return [driven]

    route_m = np.asarray(plan.route.numpy(), np.float64)
    away_m = np.hypot(*(route_m - (agent.x_m, agent.y_m)).T)
    nearest = int(away_m.argmin())
    last = nearest + round(ROUTE_AHEAD_M / graph.cell_m(plan.map)) + 1

    ahead_m = route_m[nearest:last]
    number = np.arange(len(ahead_m))
    before_m = ahead_m[(number - ROUTE_PLACES).clip(0)]
    after_m = ahead_m[(number + ROUTE_PLACES).clip(max=len(ahead_m) - 1)]
    forwards_m, leftwards_m = (after_m - before_m).T
    lane = Lane(ahead_m, np.arctan2(leftwards_m, forwards_m))

    cells = np.rint(ahead_m / graph.cell_m(plan.map)).astype(np.int64)
    lower = cells.min(axis=0)
    upper = cells.max(axis=0) + 1
    around = Extent(tuple(lower.tolist()), tuple(upper.tolist()))
    window = graph.places.window(plan.map, [PlaceColumn.ROAD], around)
    i, j = (cells - lower).T
    is_road = window.column(PlaceColumn.ROAD)[i, j] >= ROAD_FROM
    return [lane.where(_is_straight(lane) & is_road), driven]


def _is_straight(lane: Lane) -> Booleans:
    """Decide at which of its places a lane is straight, (n,)."""
    along_m = distances_along(lane.position_m)
    is_straight = np.ones(len(along_m), bool)
    for away_m in STRAIGHT_M:
        first = np.searchsorted(along_m, along_m - away_m)
        last = np.searchsorted(along_m, along_m + away_m, side="right") - 1
        for there in (first, last):
            turned_rad = np.abs(wrap_angle(lane.heading_rad[there] - lane.heading_rad))
            is_straight &= turned_rad <= MAX_TURN_RAD

    return is_straight
