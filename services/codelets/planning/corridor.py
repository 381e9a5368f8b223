"""The part of a large map that is planned on: routes are rough on the coarsest map that holds them,
then refined on finer ones (paper §5.5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.graph.graph import Graph
from cogmap.graph.window import Extent
from cogmap.schemas.nodes import (
    PLAN_ID,
    ROOT_MAP,
    Map,
    Plan,
    Self,
    coarse_map_id,
)
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.held import held_routes
from cogmap.services.codelets.planning.network import SQUARE, Here, PlaceNetwork
from cogmap.services.codelets.planning.rough import Routes, rough_network, routes_between
from cogmap.services.codelets.sub_maps.coarsening import FACTOR

MARGIN = 2
"""In cells of a coarse map, unknown places planned over around it."""

BESIDE_CELLS = 1.5
BESIDE_M = 4.0
"""How far from a route within a sub-map places are planned on: so many of its cells and metres."""


class Corridor(NamedTuple):
    """Places of the root map: a rectangle, and which of them to plan on, (w, h)."""

    extent: Extent
    is_inside: Booleans


def corridor(graph: Graph, agent: Self, goals_m: Floats, config: Config) -> Corridor | None:
    """The places beside routes between the agent and (n, 2) goals, and beside the route of the plan
    before; None where the map is small, or coarser maps have no such routes.

    The routes are those within a sub-map that holds all, where none that leaves it can be shorter.
    """
    width, height = graph.places.extent(ROOT_MAP).shape
    if agent.map != ROOT_MAP or width * height <= config.flat_places or not len(goals_m):
        return None

    ends_m = np.vstack([[agent.x_m, agent.y_m], goals_m])
    within = _over_sub_map(graph, ends_m, config) or _over_coarse_maps(graph, ends_m, config)
    if within is None:
        return None

    near_m = np.vstack([ends_m, _route_left_m(graph, agent)])
    return _with(within, near_m, graph.cell_m(ROOT_MAP), config)


def _over_sub_map(graph: Graph, ends_m: Floats, config: Config) -> Corridor | None:
    """The places beside routes within one sub-map; None where those do not serve."""
    held = held_routes(graph, ends_m, config)
    if held is None:
        return None

    cell_m = graph.cell_m(ROOT_MAP)
    reach_m = BESIDE_CELLS * held.cell_m + BESIDE_M
    return _around(held.passed_m, reach_m, cell_m)


def _over_coarse_maps(graph: Graph, ends_m: Floats, config: Config) -> Corridor | None:
    """The places beside routes over the coarse maps; None where these have no such routes."""
    within: Corridor | None = None
    for level in _levels(graph):
        routes = routes_between(_coarse(graph, level, within, config), ends_m)
        if routes is None:
            return None
        within = _refined(routes)

    return within


def _route_left_m(graph: Graph, agent: Self) -> Floats:
    """(k, 2): what the agent has not driven yet of the route of its plan."""
    plan = graph.get(Plan, PLAN_ID)
    if plan is None or plan.route is None:
        return np.zeros((0, 2))

    route_m = np.asarray(plan.route.numpy(), np.float64)
    away_m = np.hypot(*(route_m - (agent.x_m, agent.y_m)).T)
    left_m: Floats = route_m[int(away_m.argmin()) :]
    return left_m


def _levels(graph: Graph) -> list[int]:
    """The levels of the coarse maps, from the coarsest."""
    levels: list[int] = []
    level = 1
    while graph.get(Map, coarse_map_id(level)) is not None:
        levels.insert(0, level)
        level += 1

    return levels


def _coarse(graph: Graph, level: int, within: Corridor | None, config: Config) -> PlaceNetwork:
    """The place network of a coarse map, the whole of it or within a corridor."""
    map_id = coarse_map_id(level)
    if within is not None:
        return rough_network(graph, map_id, within.extent, config, within.is_inside)

    extent = graph.places.extent(map_id).grown(MARGIN)
    return rough_network(graph, map_id, extent, config)


def _refined(routes: Routes) -> Corridor:
    """The finer cells of those that routes lead through, and of those beside."""
    is_near = ndimage.binary_dilation(np.pad(routes.is_passed, 1), SQUARE)
    i, j = np.nonzero(is_near)
    rows = slice(int(i.min()), int(i.max()) + 1)
    columns = slice(int(j.min()), int(j.max()) + 1)

    is_inside = is_near[rows, columns].repeat(FACTOR, axis=0).repeat(FACTOR, axis=1)
    width, height = is_inside.shape
    first_i = FACTOR * (routes.lower[0] - 1 + rows.start) - FACTOR // 2
    first_j = FACTOR * (routes.lower[1] - 1 + columns.start) - FACTOR // 2
    return Corridor(Extent((first_i, first_j), (first_i + width, first_j + height)), is_inside)


def _around(near_m: Floats, reach_m: float, cell_m: float) -> Corridor:
    """All places within reach of (n, 2) positions."""
    margin = int(np.ceil(reach_m / cell_m)) + 1
    cells = np.rint(near_m / cell_m).astype(np.int64)
    first_i, first_j = (cells.min(axis=0) - margin).tolist()
    last_i, last_j = (cells.max(axis=0) + margin + 1).tolist()

    extent = Extent((first_i, first_j), (last_i, last_j))
    here = Here(extent.lower, extent.shape, cell_m)
    return Corridor(extent, here.is_within(reach_m, near_m))


def _with(within: Corridor, near_m: Floats, cell_m: float, config: Config) -> Corridor:
    """The corridor, and all places within `approach_m` of (n, 2) positions."""
    near = _around(near_m, config.approach_m, cell_m)
    first_i, first_j = np.minimum(within.extent.lower, near.extent.lower).tolist()
    last_i, last_j = np.maximum(within.extent.upper, near.extent.upper).tolist()

    extent = Extent((first_i, first_j), (last_i, last_j))
    is_inside = np.zeros(extent.shape, bool)
    for part in (within, near):
        i, j = np.subtract(part.extent.lower, extent.lower).tolist()
        width, height = part.extent.shape
        is_inside[i : i + width, j : j + height] |= part.is_inside
    return Corridor(extent, is_inside)
