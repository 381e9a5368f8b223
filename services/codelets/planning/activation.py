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

WAVES = (1.3, 2.6, math.inf)
"""Of the straight line's length, as far as activation spreads at first, then anew, then at last:
most routes through streets are shorter than the first, nearly all than the second."""


class Links:
    """The links of a network as costs: `matrix` (n, n), between its n cells in their order, has the
    cost of each link once.
    """

    def __init__(self, network: PlaceNetwork) -> None:
        _, width, height = network.weights.shape
        count = width * height

        # Open links in the order of the cells that own them, as rows of the matrix must be.
        of_cells = np.zeros((width, height, len(LINK_OFFSETS)), np.float32)
        for number, offset in enumerate(LINK_OFFSETS.tolist()):
            here, _ = ends(network.shape, offset)
            of_cells[*here, number] = network.weights[number][here]
        weights = of_cells.ravel()
        links = np.flatnonzero(weights).astype(np.int32)
        owner, direction = np.divmod(links, len(LINK_OFFSETS))

        units = np.hypot(*LINK_OFFSETS.T) * (network.cell_m / COST_UNIT_M)
        costs_m = np.ceil(units[direction] / weights[links]) * COST_UNIT_M
        steps = (LINK_OFFSETS @ (height, 1)).astype(np.int32)
        beyond = owner + steps[direction]
        starts = np.zeros(count + 1, np.int32)
        np.cumsum(np.bincount(owner, minlength=count), out=starts[1:])

        entries = (costs_m, beyond, starts)
        self.matrix = sparse.csr_matrix(entries, shape=(count, count))


@dataclass(frozen=True)
class Field:
    """Activation over the nodes of a network.

    `distance_m`: (width, height), the cost of the cheapest route to the nearest goal; inf where no
    activation arrives. `upward`: (n,), for each cell the one that passed on most activation to it,
    negative at goals.
    """

    network: PlaceNetwork
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

        cells = [int(np.ravel_multi_index(self.network.index_of(start), self.network.shape))]
        while self.upward[cells[-1]] >= 0:
            cells.append(int(self.upward[cells[-1]]))

        i, j = np.unravel_index(cells, self.network.shape)
        route: Indices = np.column_stack([i, j]) + np.array(self.network.origin)
        return route

    def ascend(self, start: Cell) -> Indices | None:
        """Return the (n, 2) cells from `start` to a goal, each the linked neighbour with the
        highest activation, the first of those alike (figure 5 A); None if none arrives at the
        start.

        `climb` goes to the neighbour that passed most activation on, which a dear link keeps from
        being always the same.
        """
        if not self.arrives(start):
            return None

        i, j = self.network.index_of(start)
        cells = [(i, j)]
        while self.distance_m[i, j] > 0:
            near = self._linked(i, j)
            i, j = min(near, key=lambda cell: float(self.distance_m[cell]))
            cells.append((i, j))
        route: Indices = np.array(cells, np.int64) + np.array(self.network.origin)
        return route

    def _linked(self, i: int, j: int) -> list[Cell]:
        """Return the indices of the neighbours that links lead to."""
        width, height = self.network.shape
        found = []
        for weights, (di, dj) in zip(self.network.weights, LINK_OFFSETS.tolist(), strict=True):
            if weights[i, j] > 0:
                found.append((i + di, j + dj))
            back_i, back_j = i - di, j - dj
            is_inside = 0 <= back_i < width and 0 <= back_j < height
            if is_inside and weights[back_i, back_j] > 0:
                found.append((back_i, back_j))
        return found


def spread(
    network: PlaceNetwork, goals: Indices, links: Links | None = None, until: Cell | None = None
) -> Field:
    """Spread activation from `goals`, (k, 2) cells of the map; those outside are ignored.

    It spreads as far as it can, or in WAVES, each anew, until it arrives at the cell `until`. What
    lies beyond the last wave has no activation then. Whoever spreads several times over one network
    makes its `links` once.
    """
    links = links or Links(network)
    inside = goals - np.array(network.origin)
    inside = inside[((inside >= 0) & (inside < network.shape)).all(axis=1)]
    if not len(inside):
        nowhere = np.full(network.shape, -1)
        return Field(network, np.full(network.shape, np.inf), nowhere.ravel())

    waves_m = [math.inf]
    if until is not None:
        away = np.hypot(*(inside - network.index_of(until)).T).min()
        waves_m = [wave * max(away, 1.0) * network.cell_m for wave in WAVES]

    sources = np.ravel_multi_index(tuple(inside.T), network.shape)
    for reach_m in waves_m:
        distance_m, upward, _ = dijkstra(
            links.matrix,
            directed=False,
            indices=sources,
            min_only=True,
            return_predecessors=True,
            limit=reach_m,
        )
        field = Field(network, distance_m.reshape(network.shape), upward)
        if until is not None and field.arrives(until):
            break

    return field
