"""The cheapest route over the place nodes of one map, found again and again as its links change.

Activation spreads only where a route that is not longer than another could pass: first within the
ellipse of a small detour, then, where the route is longer than that, within that of its length.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Indices
from services.codelets.planning.links import COST_UNIT_M, Links, octile
from services.codelets.planning.network import Cell, PlaceNetwork
from services.codelets.planning.route import NoRoute, NoRouteReason, Route, refusal, route_along

# How much longer than the way over free ground a route is first sought; then without limit.
DETOURS = (1.2, 1.5, math.inf)
MARGIN_CELLS = 2.0


class FlatPlanner:
    """Finds the cheapest routes over one network, which may change."""

    def __init__(self, network: PlaceNetwork) -> None:
        self._take(network)

    def update(self, network: PlaceNetwork) -> None:
        """Plan over `network` from now on."""
        if self._links.fits(network):
            self._links.update(network)
        else:
            self._take(network)

    def find_route(self, start: Cell, goal: Cell) -> Route | NoRoute:
        """The cheapest route between two cells of the map, or the reason why there is none."""
        refused = refusal(self._links, start, goal)
        if refused is not None:
            return refused

        start_node = self._links.node(start)
        goal_node = self._links.node(goal)
        free_m = self._links.cell_m * float(octile(start[0] - goal[0], start[1] - goal[1]))
        for detour in DETOURS:
            limit_m = detour * free_m + MARGIN_CELLS * self._links.cell_m
            nodes = self._ellipse(start_node, goal_node, limit_m)
            part = self._graph.part(nodes)
            distance_m = part.distances_m(goal_node)
            cost_m = float(distance_m[part.row(start_node)])
            if math.isfinite(cost_m):
                break
        else:
            return NoRoute(NoRouteReason.NOT_CONNECTED)

        if cost_m > limit_m:
            nodes = self._ellipse(start_node, goal_node, cost_m)
            part = self._graph.part(nodes)
            distance_m = part.distances_m(goal_node)
            cost_m = float(distance_m[part.row(start_node)])

        route = part.climb(distance_m, start_node)
        return route_along(self._links, route, cost_m)

    def _take(self, network: PlaceNetwork) -> None:
        self._links = Links(network)
        self._graph = self._links.graph()

    def _ellipse(self, start: int, goal: int, limit_m: float) -> Indices:
        """The linked nodes, ascending, that a route of `limit_m` between two nodes can pass."""
        links = self._links
        limit = (limit_m + COST_UNIT_M) / links.cell_m
        start_i, start_j = divmod(start, links.height)
        goal_i, goal_j = divmod(goal, links.height)
        i = _between(start_i, goal_i, limit, links.width)
        j = _between(start_j, goal_j, limit, links.height)

        from_start = octile(i[:, None] - start_i, j - start_j)
        from_goal = octile(i[:, None] - goal_i, j - goal_j)
        is_passed = from_start + from_goal <= limit
        is_linked = links.is_linked.reshape(links.width, links.height)
        is_passed &= is_linked[i[0] : i[-1] + 1, j[0] : j[-1] + 1]

        passed_i, passed_j = np.nonzero(is_passed)
        nodes: Indices = (passed_i + i[0]) * links.height + passed_j + j[0]
        return nodes


def _between(start: int, goal: int, limit: float, count: int) -> Indices:
    """The coordinates along one axis, out of `count`, that a route of length `limit` can reach."""
    slack = min((limit - abs(start - goal)) / 2, count)
    first = max(0, math.floor(min(start, goal) - slack))
    last = min(count - 1, math.ceil(max(start, goal) + slack))
    return np.arange(first, last + 1)
