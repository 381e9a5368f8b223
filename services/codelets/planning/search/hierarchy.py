"""Routes planned on a coarse level first, then refined on finer ones (paper §5.5, figure 5).

Three levels, each three times as fine as the one above. Activation spreads from the goal over the
coarsest; over the next only within the regions of the coarse route and those beside it; and over
places only within the regions of that level's route, and at times those beside it.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Indices
from cogmap.services.codelets.planning.network import NEIGHBOUR_OFFSETS, Cell, PlaceNetwork
from cogmap.services.codelets.planning.search.links import BLOCK, Links
from cogmap.services.codelets.planning.search.regions import Regions, Rows, Traits
from cogmap.services.codelets.planning.search.route import NoRoute, NoRouteReason, Route, refusal
from cogmap.services.codelets.planning.search.slots import Part

FACTOR = 3
# A route over so few regions of the middle level is refined within those beside it too, for blocks
# are large beside it; any route is, where links differ, for regions know their mean weight only.
NEAR_REGIONS = 12


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

        distances_m = corridor.distances_m(goal_node)
        cost_m = float(distances_m[corridor.row(start_node)])
        nodes = corridor.climb(distances_m, start_node, cost_m / self._links.cell_m)
        return Route(self._links.cells(nodes), self._links.cell_m, cost_m)

    def _take(self, network: PlaceNetwork) -> None:
        self._links = Links(network)
        self._hierarchy = Hierarchy(self._links)


class Hierarchy:
    """The coarser levels above the links of a network, updated as links change."""

    def __init__(self, links: Links) -> None:
        grid = (links.width, links.height)
        self._links = links
        self._places = links.graph()
        self._middle = Regions(PlaceLevel(links), grid, FACTOR, links.cell_m)
        self._coarse = Regions(self._middle, grid, BLOCK, links.cell_m)
        self._make_graphs()

    def update(self, nodes: Indices) -> None:
        """Take changes of the links of `nodes`."""
        changed = self._middle.update(nodes)
        self._coarse.update(changed)
        self._make_graphs()

    def corridor(self, start: int, goal: int) -> Part | None:
        """Places that hold a route between two, both of them linked; None where there is none."""
        ends = self._middle.region[[start, goal]]
        middle = self._middle_route(self._middle_regions.searchsorted(ends))
        if middle is None:
            return None

        if len(middle) <= NEAR_REGIONS or not self._are_alike:
            is_beside = self._middle_graph.with_neighbours(middle)
            middle = np.flatnonzero(is_beside)

        regions = self._middle_regions.take(middle)
        places = self._middle.members(regions)
        return self._places.part(places)

    def _middle_route(self, ends: Indices) -> Indices | None:
        """The route over the middle level between two of its regions."""
        coarse_start, coarse_goal = self._coarse_of[ends].tolist()
        coarse = self._coarse_graph.whole.route(coarse_start, coarse_goal)
        if coarse is None:
            return None

        is_beside = self._coarse_graph.with_neighbours(coarse)
        within = np.flatnonzero(is_beside.take(self._coarse_of))
        start, goal = ends.tolist()
        return self._middle_graph.part(within).route(start, goal)

    def _make_graphs(self) -> None:
        """Make the graphs of both levels, in which regions are numbered from 0."""
        self._are_alike = self._links.are_alike()
        self._middle_regions, self._middle_graph = self._middle.graph()
        coarse_regions, self._coarse_graph = self._coarse.graph()

        coarse_of = self._coarse.region[self._middle_regions]
        self._coarse_of = coarse_regions.searchsorted(coarse_of)


class PlaceLevel:
    """The places of a network as the finest level."""

    def __init__(self, links: Links) -> None:
        i, j = NEIGHBOUR_OFFSETS.T
        lengths = np.hypot(i, j)
        self._links = links
        self._lengths_m = links.cell_m * lengths

    def exist(self, nodes: Indices) -> Booleans:
        """Which places have a link that is not cut."""
        exist: Booleans = self._links.is_linked[nodes]
        return exist

    def rows(self, nodes: Indices) -> Rows:
        """The links of places that are not cut."""
        costs_m = self._links.costs_m[nodes]
        neighbours = self._links.neighbours[nodes]

        is_open = np.isfinite(costs_m)
        counts = is_open.sum(axis=1)
        return Rows(counts, neighbours[is_open])

    def traits(self, nodes: Indices) -> Traits:
        """Where places are, and how slowly their links can be traversed."""
        costs_m = self._links.costs_m[nodes]
        weights = self._lengths_m / costs_m
        open_links = np.count_nonzero(weights, axis=1)
        slowness = open_links / weights.sum(axis=1)

        cells = np.divmod(nodes, self._links.height)
        centre = np.stack(cells, axis=-1).astype(np.float32)
        size = np.ones(len(nodes), np.float32)
        return Traits(centre, size, slowness.astype(np.float32))
