"""The part of a large map that is planned on: a route is found on the coarsest map that holds it,
then refined on finer ones (paper §5.5, figure 5 D).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
from cogmap.services.codelets.planning.coarse_routes import Routes, coarse_network, routes_between
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.network import PlaceGrid, with_beside
from cogmap.services.codelets.planning.sub_map_routes import sub_map_routes
from cogmap.services.codelets.sub_maps.coarsening import FACTOR

MARGIN = 2
"""In cells of a coarse map, unknown places planned over around it."""

# How far from a route within a sub-map places are planned on: so many of its cells, as its grid is
# turned against the root map's, and half a street's width.
BESIDE_CELLS = 1.5
BESIDE_M = 4.0


class Corridor(NamedTuple):
    """Places of the root map: a rectangle, and which of them to plan on, (w, h)."""

    extent: Extent
    is_inside: Booleans

    @classmethod
    def around(cls, near_m: Floats, reach_m: float, cell_m: float) -> Corridor:
        """Return all places within reach of (n, 2) positions."""
        margin = int(np.ceil(reach_m / cell_m)) + 1
        cells = np.rint(near_m / cell_m).astype(np.int64)
        first_i, first_j = (cells.min(axis=0) - margin).tolist()
        last_i, last_j = (cells.max(axis=0) + margin + 1).tolist()

        extent = Extent((first_i, first_j), (last_i, last_j))
        grid = PlaceGrid(extent.lower, extent.shape, cell_m)
        return cls(extent, grid.is_within(reach_m, near_m))

    @classmethod
    def beside(cls, routes: Routes) -> Corridor:
        """Return the finer cells of those that routes on a coarse map pass, and of those beside."""
        is_near = with_beside(np.pad(routes.is_passed, 1))
        i, j = np.nonzero(is_near)
        rows = slice(int(i.min()), int(i.max()) + 1)
        columns = slice(int(j.min()), int(j.max()) + 1)

        is_inside = is_near[rows, columns].repeat(FACTOR, axis=0).repeat(FACTOR, axis=1)
        width, height = is_inside.shape
        first_i = FACTOR * (routes.lower[0] - 1 + rows.start) - FACTOR // 2
        first_j = FACTOR * (routes.lower[1] - 1 + columns.start) - FACTOR // 2
        return cls(Extent((first_i, first_j), (first_i + width, first_j + height)), is_inside)

    def united(self, other: Corridor) -> Corridor:
        """Return the places of both corridors."""
        first_i, first_j = np.minimum(self.extent.lower, other.extent.lower).tolist()
        last_i, last_j = np.maximum(self.extent.upper, other.extent.upper).tolist()

        extent = Extent((first_i, first_j), (last_i, last_j))
        is_inside = np.zeros(extent.shape, bool)
        for part in (self, other):
            i, j = np.subtract(part.extent.lower, extent.lower).tolist()
            width, height = part.extent.shape
            is_inside[i : i + width, j : j + height] |= part.is_inside
        return Corridor(extent, is_inside)


def corridor(graph: Graph, agent: Self, goals_m: Floats, config: Config) -> Corridor | None:
    """Find the places beside routes between the agent and (n, 2) goals, and beside the route of the
    plan before; None if the map is small enough to be searched whole, or coarser maps have no such
    routes.

    The routes are those within a sub-map that holds all, if none that leaves it can be shorter.
    """
    is_small = _places(graph, ROOT_MAP) <= config.search_places
    if agent.map != ROOT_MAP or is_small or not len(goals_m):
        return None

    cell_m = graph.cell_m(ROOT_MAP)
    ends_m = np.vstack([[agent.x_m, agent.y_m], goals_m])
    within: Corridor | None = None
    found = sub_map_routes(graph, ends_m, config)
    if found is not None:
        reach_m = BESIDE_CELLS * found.cell_m + BESIDE_M
        within = Corridor.around(found.passed_m, reach_m, cell_m)
    else:
        for map_id in coarse_maps(graph, config):
            if within is None:
                extent = graph.places.extent(map_id).grown(MARGIN)
                network = coarse_network(graph, map_id, extent, config)
            else:
                network = coarse_network(graph, map_id, within.extent, config, within.is_inside)
            routes = routes_between(network, ends_m)
            if routes is None:
                return None
            within = Corridor.beside(routes)

    if within is None:
        return None

    # What the agent has not driven yet of the route before stays in the corridor.
    near_m = ends_m
    plan = graph.get(Plan, PLAN_ID)
    if plan is not None and plan.route is not None:
        route_m = np.asarray(plan.route.numpy(), np.float64)
        away_m = np.hypot(*(route_m - ends_m[0]).T)
        near_m = np.vstack([near_m, route_m[int(away_m.argmin()) :]])
    return within.united(Corridor.around(near_m, config.approach_m, cell_m))


def coarse_maps(graph: Graph, config: Config) -> list[str]:
    """Return the maps on which a route is found first, from the coarsest: each level until one is
    small enough to be searched whole.
    """
    maps: list[str] = []
    map_id = ROOT_MAP
    while _places(graph, map_id) > config.search_places:
        map_id = coarse_map_id(len(maps) + 1)
        if graph.get(Map, map_id) is None:
            break
        maps.insert(0, map_id)
    return maps


def _places(graph: Graph, map_id: str) -> int:
    """Count the places of a map's rectangle."""
    width, height = graph.places.extent(map_id).shape
    return width * height
