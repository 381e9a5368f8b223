"""Activation that spreads from goals over place nodes, and routes up its gradient (paper §5.5).

A link passes on exp(-2x) of the activation that it receives, x its cost in cells, so the logarithm
of a node's activation is minus its distance from the goal. Distances are what is computed: nothing
underflows, however far the goal. The route climbs from node to neighbour up the activation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork
from cogmap.services.codelets.planning.search.links import Links
from cogmap.services.codelets.planning.search.route import (
    NoRoute,
    NoRouteReason,
    Route,
    refusal,
)
from cogmap.services.codelets.planning.search.slots import MAX_COST_M

DECAY_PER_CELL = 2.0


@dataclass(frozen=True)
class Field:
    """Activation over the nodes of a network, by the links that it had.

    `node_distance_m`: the cost of the cheapest route to the nearest goal, by the nodes of `links`;
    inf where no activation arrives.
    """

    links: Links
    node_distance_m: Floats

    @property
    def distance_m(self) -> Floats:
        """(width, height): the cost of the cheapest route to the nearest goal, inf where no
        activation arrives.
        """
        links = self.links
        width, height = links.shape
        padded = self.node_distance_m.reshape(links.width, links.height)
        return padded[:width, :height]

    @property
    def log_activation(self) -> Floats:
        """(width, height): the logarithm of the activation, which is 1 at a goal."""
        log: Floats = -DECAY_PER_CELL * self.distance_m / self.links.cell_m
        return log

    @property
    def activation(self) -> Floats:
        """(width, height): the activation, 0 where none arrives, or too little to represent."""
        return np.exp(self.log_activation)


def spread(network: PlaceNetwork, goals: Indices) -> Field:
    """The activation from `goals`, (k, 2) cells of the map; those outside are ignored.

    Whoever plans again and again on one network keeps its Links, and calls `spread_over`.
    """
    return spread_over(Links(network), goals)


def spread_over(links: Links, goals: Indices) -> Field:
    """The activation from `goals`, (k, 2) cells of the map; those outside are ignored."""
    nodes = []
    for i, j in goals.tolist():
        if links.contain((i, j)):
            nodes.append(links.node((i, j)))

    if not nodes:
        return Field(links, np.full(links.count, np.inf))

    distance_m = dijkstra(links.matrix(), indices=nodes, min_only=True, limit=MAX_COST_M)
    return Field(links, distance_m)


def climb(network: PlaceNetwork, field: Field, start: Cell) -> Indices | None:
    """(n, 2) cells from `start` to a goal, each the neighbour that passed on most activation.

    Of equal ones the first in the order of NEIGHBOUR_OFFSETS is taken. None where no activation
    arrives at the start. Links are those that the field spread over, whatever became of them since,
    so that the route has no loop.
    """
    if not network.contains(start):
        return None

    links = field.links
    nodes = _climb(field, links.node(start))
    if nodes is None:
        return None

    return links.cells(nodes)


def find_route(network: PlaceNetwork, start: Cell, goal: Cell) -> Route | NoRoute:
    """The cheapest route between two cells of the map, or the reason why there is none.

    Whoever plans again and again on one network keeps a FlatPlanner or HierarchicalPlanner.
    """
    links = Links(network)
    refused = refusal(links, start, goal)
    if refused is not None:
        return refused

    field = spread_over(links, np.array([goal]))
    start_node = links.node(start)
    nodes = _climb(field, start_node)
    if nodes is None:
        return NoRoute(NoRouteReason.NOT_CONNECTED)

    cost_m = float(field.node_distance_m[start_node])
    return Route(links.cells(nodes), links.cell_m, cost_m)


def _climb(field: Field, start: int) -> Indices | None:
    """The nodes from `start` to a goal; None where no activation arrives."""
    links = field.links
    distances_m = field.node_distance_m
    if not np.isfinite(distances_m[start]):
        return None

    nodes = [start]
    while distances_m[nodes[-1]] > 0:
        neighbours = links.neighbours[nodes[-1]]
        through_m = distances_m[neighbours] + links.costs_m[nodes[-1]]
        best = neighbours[through_m.argmin()]
        nodes.append(int(best))

    return np.array(nodes)
