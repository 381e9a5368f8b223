"""Road that the plan counted on and that is closed now: a prediction of the plan that fails."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.graph.graph import Graph
from cogmap.graph.window import ROAD_FROM, Extent
from schemas.nodes import PLAN_ID, PlaceColumn, Plan, Self, place_cell, place_id
from services.codelets.planning.ground import stands_there

# The range scan reaches no farther ahead.
AHEAD_M = 60.0
# What is found so near to where a street was closed is the same closure, for as many cycles.
SAME_M = 12.0
SAME_CYCLES = 3000


def closed_place(agent: Self, graph: Graph) -> str:
    """The id of the first place node ahead on the plan's route that was road, and where something
    stands now; empty where there is none, and where the plan is to find out whether there is.
    """
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None or plan.doubtful or plan.map != agent.map:
        return ""

    cells = _ahead(plan, agent, graph.cell_m(plan.map))
    lower_i, lower_j = (cells.min(axis=0) - 2).tolist()
    upper_i, upper_j = (cells.max(axis=0) + 3).tolist()
    around = Extent((lower_i, lower_j), (upper_i, upper_j))
    window = graph.places.window(plan.map, [PlaceColumn.OBSTACLE, PlaceColumn.ROAD], around)

    is_closed = stands_there(window.column(PlaceColumn.OBSTACLE))
    is_closed &= window.column(PlaceColumn.ROAD) >= ROAD_FROM
    closed = cells[is_closed[tuple((cells - around.lower).T)]]
    if not len(closed):
        return ""

    i, j = closed[0].tolist()
    return place_id(i, j, plan.map)


def is_known(place: str, noted: dict[str, int], cycle: int, cell_m: float) -> bool:
    """Whether a place node is near one that was noted, by its id, in a cycle not long ago."""
    for known, noted_cycle in noted.items():
        away_m = _away_m(place, known, cell_m)
        if cycle - noted_cycle <= SAME_CYCLES and away_m <= SAME_M:
            return True

    return False


def _ahead(plan: Plan, agent: Self, cell_m: float) -> Indices:
    """(n, 2): the cells of the route from the one nearest to the agent to AHEAD_M further."""
    assert plan.route is not None
    route_m = np.asarray(plan.route.numpy(), np.float64)
    away_m = np.hypot(*(route_m - (agent.x_m, agent.y_m)).T)
    nearest = int(away_m.argmin())
    last = nearest + round(AHEAD_M / cell_m) + 1

    cells: Indices = np.rint(route_m[nearest:last] / cell_m).astype(np.int64)
    return cells


def _away_m(place: str, other: str, cell_m: float) -> float:
    """How far apart two place nodes are; infinite of any other nodes, or on different maps."""
    here = place_cell(place)
    there = place_cell(other)
    if here is None or there is None or here[0] != there[0]:
        return math.inf

    return math.dist(here[1:], there[1:]) * cell_m
