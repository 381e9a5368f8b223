"""Road that the plan counted on, or that the agent drove over, and that is closed now: a prediction
that fails.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.graph.graph import Graph
from cogmap.graph.window import ROAD_FROM, Extent
from schemas.nodes import (
    PLAN_ID,
    SELF_ID,
    PathColumn,
    PlaceColumn,
    Plan,
    Self,
    place_cell,
    place_id,
)
from services.codelets.planning.driven import POSITION, path_of
from services.codelets.planning.ground import stands_there

# The range scan reaches no farther ahead.
AHEAD_M = 60.0
# Farther away, where the agent drove and what stands there are less sure than a street is wide.
DRIVEN_M = 30.0
# What stands beside a path that is a metre off does not reach so far across it.
ACROSS_M = np.arange(-2.0, 3.0)
# What is found so near to where a street was closed is the same closure, for as many cycles.
SAME_M = 12.0
SAME_CYCLES = 3000


def closed_places(agent: Self, graph: Graph) -> list[str]:
    """The ids of place nodes where something stands now: the first ahead on the plan's route that
    was road, unless the plan is to find out whether there is any; and the nearest that the agent
    drove over, where what stands there reaches across its path.
    """
    ahead = _first_closed(_route_ahead(agent, graph), agent.map, graph, ROAD_FROM)
    driven = _first_closed(_driven_across(agent, graph), agent.map, graph)
    return [place for place in (ahead, driven) if place]


def expected_by(place: str, graph: Graph) -> str:
    """The id of what counted on a place node that is closed: the plan, if its route leads past
    there, else the agent, which drove there.
    """
    plan = graph.get(Plan, PLAN_ID)
    cell = place_cell(place)
    if plan is None or plan.route is None or cell is None or plan.map != cell[0]:
        return SELF_ID

    at_m = np.array(cell[1:]) * graph.cell_m(plan.map)
    away_m = np.hypot(*(plan.route.numpy() - at_m).T)
    return PLAN_ID if float(away_m.min()) <= SAME_M else SELF_ID


def _first_closed(cells: Indices, map_id: str, graph: Graph, road_from: float = 0.0) -> str:
    """The id of the middle place node of the first of (n, k, 2) cells abreast on all of which
    something stands, and road was seen `road_from` at least; empty where there are none.
    """
    if not cells.size:
        return ""

    flat = cells.reshape(-1, 2)
    lower_i, lower_j = (flat.min(axis=0) - 2).tolist()
    upper_i, upper_j = (flat.max(axis=0) + 3).tolist()
    around = Extent((lower_i, lower_j), (upper_i, upper_j))
    window = graph.places.window(map_id, [PlaceColumn.OBSTACLE, PlaceColumn.ROAD], around)

    is_closed = stands_there(window.column(PlaceColumn.OBSTACLE))
    is_closed &= window.column(PlaceColumn.ROAD) >= road_from
    i, j = (flat - around.lower).T
    is_across = is_closed[i, j].reshape(cells.shape[:2]).all(axis=1)
    closed = np.flatnonzero(is_across)
    if not len(closed):
        return ""

    middle_i, middle_j = cells[closed[0], cells.shape[1] // 2].tolist()
    return place_id(middle_i, middle_j, map_id)


def is_known(place: str, noted: dict[str, int], cycle: int, cell_m: float) -> bool:
    """Whether a place node is near one that was noted, by its id, in a cycle not long ago."""
    for known, noted_cycle in noted.items():
        away_m = _away_m(place, known, cell_m)
        if cycle - noted_cycle <= SAME_CYCLES and away_m <= SAME_M:
            return True

    return False


def _route_ahead(agent: Self, graph: Graph) -> Indices:
    """(n, 1, 2): the cells of the plan's route from the one nearest to the agent to AHEAD_M
    further; none of a plan that is to find out whether a street is closed.
    """
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None or plan.doubtful or plan.map != agent.map:
        return np.zeros((0, 1, 2), np.int64)

    cell_m = graph.cell_m(plan.map)
    route_m = np.asarray(plan.route.numpy(), np.float64)
    away_m = np.hypot(*(route_m - (agent.x_m, agent.y_m)).T)
    nearest = int(away_m.argmin())
    last = nearest + round(AHEAD_M / cell_m) + 1

    cells: Indices = np.rint(route_m[nearest:last] / cell_m).astype(np.int64)
    return cells[:, None]


def _driven_across(agent: Self, graph: Graph) -> Indices:
    """(n, k, 2): the cells across the path where the agent drove not far from here, the nearest
    first.
    """
    path = path_of(graph)
    away_m = np.hypot(*(path[:, POSITION] - (agent.x_m, agent.y_m)).T)
    nearest = np.argsort(away_m, kind="stable")
    near = path[nearest[: int((away_m <= DRIVEN_M).sum())]]

    heading_rad = near[:, PathColumn.HEADING_RAD]
    leftwards = np.stack([-np.sin(heading_rad), np.cos(heading_rad)], axis=-1)
    across_m = near[:, None, POSITION] + ACROSS_M[:, None] * leftwards[:, None]
    cells: Indices = np.rint(across_m / graph.cell_m(agent.map)).astype(np.int64)
    return cells


def _away_m(place: str, other: str, cell_m: float) -> float:
    """How far apart two place nodes are; infinite of any other nodes, or on different maps."""
    here = place_cell(place)
    there = place_cell(other)
    if here is None or there is None or here[0] != there[0]:
        return math.inf

    return math.dist(here[1:], there[1:]) * cell_m
