"""Activation that spreads from goals over place nodes, and routes up its gradient (paper §5.5).

A link passes on exp(-2x) of the activation that it receives, x its cost in cells, so the logarithm
of a node's activation is minus its distance from the goal. Distances are what is computed: nothing
underflows, however far the goal. The route climbs from node to neighbour up the activation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Floats, Indices
from cogmap.graph.window import LINK_OFFSETS
from cogmap.services.codelets.planning.network import Cell, PlaceNetwork, ends

DECAY_PER_CELL = 2.0
"""Paper §5.5."""

COST_UNIT_M = 2.0**-20
"""Costs are multiples of this, so that their sums are exact and ties are ties on every machine."""

_NONE = -1


class Links:
    """The links of a network as costs.

    Its nodes are the places that have a link, numbered from 0 in the order of their cells: `places`
    (n,) are their indices in an array of all cells, `number` (w, h) is -1 elsewhere. `matrix`
    (n, n) has the cost of each link once.
    """

    def __init__(self, network: PlaceNetwork) -> None:
        weights = np.zeros_like(network.weights)
        is_linked = np.zeros(network.shape, bool)
        for number, offset in enumerate(LINK_OFFSETS.tolist()):
            here, there = ends(network.shape, offset)
            inside = network.weights[number][here]
            weights[number][here] = inside
            is_linked[here] |= inside > 0
            is_linked[there] |= inside > 0

        _, height = network.shape
        self.places = np.flatnonzero(is_linked)
        self.number = np.full(network.shape, _NONE, np.int32)
        self.number.ravel()[self.places] = np.arange(len(self.places), dtype=np.int32)

        # Open links in the order of the nodes that own them, as rows of the matrix must be.
        weights = weights.reshape(len(LINK_OFFSETS), -1)[:, self.places].T
        owner, direction = np.nonzero(weights)
        beyond = self.places[owner] + (LINK_OFFSETS @ (height, 1))[direction]
        units = np.hypot(*LINK_OFFSETS.T) * (network.cell_m / COST_UNIT_M)
        costs_m = np.ceil(units[direction] / weights[owner, direction].clip(max=1.0)) * COST_UNIT_M

        count = len(self.places)
        starts = np.concatenate([[0], np.count_nonzero(weights, axis=1).cumsum()])
        entries = (costs_m, self.number.ravel()[beyond], starts.astype(np.int32))
        self.matrix = sparse.csr_matrix(entries, shape=(count, count))


@dataclass(frozen=True)
class Field:
    """Activation over the nodes of a network.

    `distance_m`: (width, height), the cost of the cheapest route to the nearest goal; inf where no
    activation arrives. `upward`: (n,), for each node the one that passed on most activation to it.
    """

    network: PlaceNetwork
    links: Links
    distance_m: Floats
    upward: Indices

    @property
    def log_activation(self) -> Floats:
        """Return the logarithm of the activation (width, height), which is 1 at a goal."""
        log: Floats = -DECAY_PER_CELL * self.distance_m / self.network.cell_m
        return log

    @property
    def activation(self) -> Floats:
        """Return the activation (width, height), 0 if none arrives or too little to represent."""
        return np.exp(self.log_activation)

    def arrives(self, cell: Cell) -> bool:
        """Decide whether activation arrives at a cell of the map."""
        is_inside = self.network.contains(cell)
        return is_inside and math.isfinite(self.distance_m[self.network.index_of(cell)])

    def climb(self, start: Cell) -> Indices | None:
        """Return the (n, 2) cells from `start` to a goal, up the activation; None if none arrives
        at the start.
        """
        if not self.arrives(start):
            return None

        node = int(self.links.number[self.network.index_of(start)])
        if node == _NONE:
            return np.array([start], np.int64)

        nodes = [node]
        while self.upward[nodes[-1]] >= 0:
            nodes.append(int(self.upward[nodes[-1]]))

        i, j = np.unravel_index(self.links.places[nodes], self.network.shape)
        cells: Indices = np.column_stack([i, j]) + np.array(self.network.origin)
        return cells


def spread(network: PlaceNetwork, goals: Indices, links: Links | None = None) -> Field:
    """Spread activation from `goals`, (k, 2) cells of the map; those outside are ignored.

    Whoever spreads several times over one network makes its `links` once.
    """
    links = links or Links(network)
    distance_m = np.full(network.shape, np.inf)
    nodes = []
    for i, j in goals.tolist():
        if network.contains((i, j)):
            place = network.index_of((i, j))
            distance_m[place] = 0.0
            nodes.append(int(links.number[place]))

    upward: Indices = np.full(len(links.places), _NONE)
    nodes = [node for node in nodes if node != _NONE]
    if nodes:
        distance_m.ravel()[links.places], upward, _ = dijkstra(
            links.matrix, directed=False, indices=nodes, min_only=True, return_predecessors=True
        )
    return Field(network, links, distance_m, upward)
