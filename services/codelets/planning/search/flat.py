"""The cheapest route over the place nodes of one map, found again and again as its links change.

Activation spreads only where a route shorter than a limit could pass: an ellipse about start and
goal. Where the route found is longer than its ellipse was made for, another is made for its length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork
from cogmap.services.codelets.planning.search.links import Links, octile
from cogmap.services.codelets.planning.search.route import NoRoute, NoRouteReason, Route, refusal
from cogmap.services.codelets.planning.search.slots import Part

# How much longer than over free ground a route may be that is sought first.
DETOUR = 1.3
MARGIN_CELLS = 2.0
# Lengths are compared in single precision, which is to lose no node.
ROUNDING = 1 + 1e-5


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
        found = self._find(start_node, goal_node)
        if found is None:
            return NoRoute(NoRouteReason.NOT_CONNECTED)

        steps = found.cost_m / self._links.cell_m
        nodes = found.part.climb(found.distances_m, start_node, steps)
        return Route(self._links.cells(nodes), self._links.cell_m, found.cost_m)

    def _take(self, network: PlaceNetwork) -> None:
        self._links = Links(network)
        self._graph = self._links.graph()

    def _find(self, start: int, goal: int) -> _Found | None:
        """Activation that has reached `start` by the cheapest route; None where there is none."""
        cells = DETOUR * self._free_cells(start, goal) + MARGIN_CELLS
        limit_m = cells * self._links.cell_m
        part = self._graph.part(self._ellipse(start, goal, limit_m))

        found = _spread(part, start, goal)
        if found.cost_m <= limit_m:
            return found
        if math.isfinite(found.cost_m):
            part = self._graph.part(self._ellipse(start, goal, found.cost_m))
            return _spread(part, start, goal)

        found = _spread(self._graph.whole, start, goal)
        if math.isinf(found.cost_m):
            return None

        return found

    def _free_cells(self, start: int, goal: int) -> float:
        """The length of the shortest route between two nodes if all places were free."""
        ends = np.array([start, goal])
        cells = self._links.cells(ends)

        i, j = cells[1] - cells[0]
        return float(octile(i, j))

    def _ellipse(self, start: int, goal: int, limit_m: float) -> Indices:
        """The linked nodes, ascending, that a route of `limit_m` between two nodes can pass."""
        links = self._links
        limit = limit_m / links.cell_m * ROUNDING
        start_i, start_j = divmod(start, links.height)
        goal_i, goal_j = divmod(goal, links.height)
        first, end = _between(start_i, goal_i, limit, links.width)

        i = np.arange(first, end, dtype=np.float32)[:, None]
        j = np.arange(links.height, dtype=np.float32)
        from_start = octile(i - start_i, j - start_j)
        from_goal = octile(i - goal_i, j - goal_j)
        is_near = from_start + from_goal <= limit

        is_linked = links.is_linked.reshape(links.width, links.height)
        is_near &= is_linked[first:end]
        return np.flatnonzero(is_near) + first * links.height


class _Found(NamedTuple):
    """Activation within a part of the network, and what the route from the start costs there."""

    part: Part
    distances_m: Floats
    cost_m: float


def _spread(part: Part, start: int, goal: int) -> _Found:
    """Activation from `goal` within a part of the network."""
    distances_m = part.distances_m(goal)
    row = part.row(start)
    return _Found(part, distances_m, float(distances_m[row]))


def _between(start: int, goal: int, limit: float, count: int) -> tuple[int, int]:
    """The range of coordinates along one axis, out of `count`, that a route can reach whose length
    is at most `limit`.
    """
    apart = abs(start - goal)
    beyond = (limit - apart) / 2
    slack = math.ceil(min(beyond, count))

    first = min(start, goal) - slack
    last = max(start, goal) + slack
    return max(first, 0), min(last + 1, count)
