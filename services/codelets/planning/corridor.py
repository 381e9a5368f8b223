"""The part of a large map that is planned on: routes are rough on the coarsest map that holds them,
then refined on finer ones (paper §5.5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.graph.graph import Graph
from cogmap.graph.window import ROAD_FROM, WEIGHT_COLUMNS, Extent
from schemas.nodes import (
    PLAN_ID,
    ROOT_MAP,
    Map,
    PlaceColumn,
    Plan,
    Self,
    coarse_map_id,
)
from services.codelets.planning.activation import climb, spread_over
from services.codelets.planning.config import Config
from services.codelets.planning.network import (
    SQUARE,
    Cell,
    Here,
    PlaceNetwork,
    link_weights,
)
from services.codelets.planning.search.links import Links
from services.codelets.resolution.coarsening import FACTOR

COLUMNS = (PlaceColumn.ROAD, *WEIGHT_COLUMNS)
MARGIN = 2
SNAP = 2
"""In cells of a coarse map: unknown places planned over around it, and how far from a position the
place may be from which it is reached.
"""


class Corridor(NamedTuple):
    """Places of the root map: a rectangle, and which of them to plan on, (w, h)."""

    extent: Extent
    is_inside: Booleans


def corridor(graph: Graph, agent: Self, goals_m: Floats, config: Config) -> Corridor | None:
    """The places beside routes between the agent and (n, 2) goals, and beside the route of the plan
    before; None where the map is small, or coarser maps have no such routes.
    """
    width, height = graph.places.extent(ROOT_MAP).shape
    if agent.map != ROOT_MAP or width * height <= config.flat_places or not len(goals_m):
        return None

    ends_m = np.vstack([[agent.x_m, agent.y_m], goals_m])
    within: Corridor | None = None
    for level in _levels(graph):
        routes = _routes(_coarse(graph, level, within, config), ends_m)
        if routes is None:
            return None
        within = _refined(routes)

    if within is None:
        return None

    near_m = np.vstack([ends_m, _route_left_m(graph, agent)])
    return _with(within, near_m, graph.cell_m(ROOT_MAP), config)


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
    extent = graph.places.extent(map_id).grown(MARGIN) if within is None else within.extent
    window = graph.places.window(map_id, COLUMNS, extent)
    is_road = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    share = np.where(is_road, 1.0, config.unknown_weight)
    if within is not None:
        share[~within.is_inside] = 0.0

    here = Here(window.origin, window.shape, graph.cell_m(map_id))
    return here.network(link_weights(window.weights(), share))


class _Routes(NamedTuple):
    """A rectangle of a coarse map, and the cells of it that routes lead through, (w, h)."""

    lower: tuple[int, int]
    is_passed: Booleans


def _routes(network: PlaceNetwork, ends_m: Floats) -> _Routes | None:
    """The routes between each two of (n, 2) positions; None where one is outside, or not
    connected.
    """
    links = Links(network)
    cells: list[Cell] = []
    is_passed = np.zeros(network.shape, bool)
    for end_m in ends_m:
        goal = _linked(network, links, end_m)
        if goal is None:
            return None

        field = spread_over(links, np.array([goal]))
        for start in cells:
            route = climb(network, field, start)
            if route is None:
                return None
            is_passed[tuple((route - network.origin).T)] = True
        cells.append(goal)

    return _Routes(network.origin, is_passed)


def _linked(network: PlaceNetwork, links: Links, position_m: Floats) -> Cell | None:
    """The cell nearest to a position that a link leads to, within SNAP."""
    middle = np.rint(position_m / network.cell_m).astype(np.int64)
    around = np.argwhere(np.ones((2 * SNAP + 1, 2 * SNAP + 1))) - SNAP
    cells = middle + around[np.hypot(*around.T).argsort(kind="stable")]
    for i, j in cells.tolist():
        if links.contain((i, j)) and links.is_linked[links.node((i, j))]:
            return i, j

    return None


def _refined(routes: _Routes) -> Corridor:
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


def _with(within: Corridor, near_m: Floats, cell_m: float, config: Config) -> Corridor:
    """The corridor, and all places within `approach_m` of (n, 2) positions."""
    margin = int(np.ceil(config.approach_m / cell_m)) + 1
    cells = np.rint(near_m / cell_m).astype(np.int64)
    lower = np.minimum(within.extent.lower, cells.min(axis=0) - margin)
    upper = np.maximum(within.extent.upper, cells.max(axis=0) + margin + 1)
    first_i, first_j = lower.tolist()
    last_i, last_j = upper.tolist()

    extent = Extent((first_i, first_j), (last_i, last_j))
    here = Here(extent.lower, extent.shape, cell_m)
    is_inside = here.is_within(config.approach_m, near_m)
    i, j = np.array(within.extent.lower) - lower
    width, height = within.extent.shape
    is_inside[i : i + width, j : j + height] |= within.is_inside
    return Corridor(extent, is_inside)
