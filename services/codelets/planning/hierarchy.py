"""Routes planned on a coarse level first, then refined on finer ones (paper §5.5, figure 5).

Three levels, each three times as fine as the one above it. Activation spreads from the goal over the
coarsest, over the next level only within what the coarse route and its neighbours hold, and over the
places only within the route of that.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from services.codelets.planning.links import BLOCK, Links
from services.codelets.planning.network import NEIGHBOUR_OFFSETS, Cell, PlaceNetwork
from services.codelets.planning.regions import Regions, Rows, Traits
from services.codelets.planning.route import NoRoute, NoRouteReason, Route, refusal, route_along
from services.codelets.planning.slots import Part

FACTOR = 3


class Places:
    """The places of a network as the finest level."""

    def __init__(self, links: Links) -> None:
        self._links = links
        self._lengths_m = links.cell_m * np.hypot(*NEIGHBOUR_OFFSETS.T)

    def exist(self, nodes: Indices) -> Booleans:
        """Which places have a link that is not cut."""
        return self._links.is_linked[nodes]

    def rows(self, nodes: Indices) -> Rows:
        """The links of places that are not cut."""
        costs_m = self._links.costs_m[nodes]
        is_open = np.isfinite(costs_m)
        columns = self._links.neighbours[nodes][is_open]
        return Rows(is_open.sum(axis=1), columns.astype(np.int64), costs_m[is_open])

    def traits(self, nodes: Indices) -> Traits:
        """Where places are, and how slowly their links can be traversed."""
        centre = np.stack(np.divmod(nodes, self._links.height), axis=-1)
        return Traits(centre.astype(np.float64), np.ones(len(nodes)), self._slowness(nodes))

    def _slowness(self, nodes: Indices) -> Floats:
        weights = self._lengths_m / self._links.costs_m[nodes]
        open_links = np.count_nonzero(weights, axis=1)
        slowness: Floats = open_links / weights.sum(axis=1)
        return slowness


class Hierarchy:
    """The coarser levels above the links of a network, updated as links change."""

    def __init__(self, links: Links) -> None:
        grid = (links.width, links.height)
        self._places = links.graph()
        self._middle = Regions(Places(links), grid, FACTOR, links.cell_m)
        self._coarse = Regions(self._middle, grid, BLOCK, links.cell_m)
        self._number()

    def update(self, nodes: Indices) -> None:
        """Take changes of the links of `nodes`."""
        changed = self._middle.update(nodes)
        self._coarse.update(changed)
        self._number()

    def corridor(self, start: int, goal: int) -> Part | None:
        """Places that hold a route between two, both of them linked; None where there is none."""
        ends = self._middle.region[[start, goal]]
        middle_start, middle_goal = self._middle_regions.searchsorted(ends).tolist()
        coarse_start, coarse_goal = self._coarse_of[[middle_start, middle_goal]].tolist()

        coarse = self._coarse_part.route(coarse_start, coarse_goal)
        if coarse is None:
            return None

        within = self._members(coarse)
        middle = self._middle_graph.part(within).route(middle_start, middle_goal)
        if middle is None:
            return None

        regions = self._middle_regions.take(middle)
        return self._places.part(self._middle.members(regions))

    def _members(self, coarse: Indices) -> Indices:
        """The regions of the middle level in coarse ones and those beside them."""
        is_within = np.zeros(len(self._coarse_graph.neighbours), bool)
        is_within[coarse] = True
        is_within[self._coarse_graph.neighbours.take(coarse, axis=0)] = True
        return np.flatnonzero(is_within.take(self._coarse_of))

    def _number(self) -> None:
        """Number the regions of each level, as their graphs do."""
        self._middle_regions, self._middle_graph = self._middle.graph()
        coarse_regions, self._coarse_graph = self._coarse.graph()
        regions = self._coarse.region[self._middle_regions]
        self._coarse_of = coarse_regions.searchsorted(regions)
        self._coarse_part = self._coarse_graph.part(np.arange(len(coarse_regions)))


class HierarchicalPlanner:
    """Finds routes over one network, which may change: nearly the cheapest, and fast."""

    def __init__(self, network: PlaceNetwork) -> None:
        self._take(network)

    def update(self, network: PlaceNetwork) -> None:
        """Plan over `network` from now on."""
        if not self._links.fits(network):
            self._take(network)
            return

        changed = self._links.update(network)
        if len(changed):
            self._hierarchy.update(changed)

    def find_route(self, start: Cell, goal: Cell) -> Route | NoRoute:
        """A route between two cells of the map, or the reason why there is none."""
        refused = refusal(self._links, start, goal)
        if refused is not None:
            return refused

        start_node = self._links.node(start)
        goal_node = self._links.node(goal)
        corridor = self._hierarchy.corridor(start_node, goal_node)
        if corridor is None:
            return NoRoute(NoRouteReason.NOT_CONNECTED)

        distance_m = corridor.distances_m(goal_node)
        route = corridor.climb_all(distance_m, start_node)
        cost_m = float(distance_m[corridor.row(start_node)])
        return route_along(self._links, route, cost_m)

    def _take(self, network: PlaceNetwork) -> None:
        self._links = Links(network)
        self._hierarchy = Hierarchy(self._links)
