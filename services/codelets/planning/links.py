"""The links of a place network as costs, kept from one plan to the next.

A node has a slot for each of its eight links, so that a link that is cut or opened changes two
numbers. Nodes are numbered i * height + j, over a grid padded to whole blocks of the hierarchy.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy import sparse

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from services.codelets.planning.network import (
    LINK_OFFSETS,
    NEIGHBOUR_OFFSETS,
    Cell,
    PlaceNetwork,
)
from services.codelets.planning.slots import Numbers, SlotGraph

# Costs are multiples of this, so that their sums are exact and ties are ties on every machine.
COST_UNIT_M = 2.0**-20
# The edge of a block of the coarsest level of the hierarchy, in cells.
BLOCK = 9
SLOTS = len(NEIGHBOUR_OFFSETS)
_LINKS = len(LINK_OFFSETS)


class Links:
    """The links of a network, to be updated as they change.

    `costs_m`: (n, SLOTS), inf where a link is cut. `neighbours`: (n, SLOTS) nodes, in the order of
    NEIGHBOUR_OFFSETS. `is_linked`: (n,), whether a node has a link that is not cut.
    """

    def __init__(self, network: PlaceNetwork) -> None:
        width, height = network.shape
        self.origin = network.origin
        self.cell_m = network.cell_m
        self.shape = (width, height)
        self.width = _padded(width)
        self.height = _padded(height)
        self.count = self.width * self.height
        self._weights = network.weights.copy()
        i, j = np.divmod(np.arange(self.count), self.height)
        self._cells: Indices = np.stack([i, j], axis=-1) + np.array(self.origin)

        # What lies beyond an edge is a blocked node of the padding.
        nodes = np.arange(self.count, dtype=np.int32)
        offsets = NEIGHBOUR_OFFSETS @ (self.height, 1)
        self.neighbours: Numbers = nodes[:, None] + offsets.astype(np.int32)
        self.neighbours %= self.count

        costs_m = np.full((self.width, self.height, SLOTS), np.inf)
        for link, offset in enumerate(LINK_OFFSETS.tolist()):
            here, there = _ends(self.shape, offset)
            of_link = link_costs_m(network.weights[link][here], self.cell_m * math.hypot(*offset))
            costs_m[(*here, link)] = of_link
            costs_m[(*there, link + _LINKS)] = of_link

        self.costs_m: Floats = costs_m.reshape(self.count, SLOTS)
        self.is_linked: Booleans = np.any(np.isfinite(self.costs_m), axis=1)

    def fits(self, network: PlaceNetwork) -> bool:
        """Whether a network has the same cells, so that this can be updated to it."""
        here = (self.origin, self.cell_m, self.shape)
        return here == (network.origin, network.cell_m, network.shape)

    def update(self, network: PlaceNetwork) -> Indices:
        """Take the weights of `network`, which has the same cells.

        Returns the nodes with a link whose weight is another, in ascending order.
        """
        changed = []
        for link, offset in enumerate(LINK_OFFSETS.tolist()):
            here, _ = _ends(self.shape, offset)
            weights = network.weights[link][here]
            i, j = np.nonzero(weights != self._weights[link][here])
            costs_m = link_costs_m(weights[i, j], self.cell_m * math.hypot(*offset))

            first_i, first_j = here[0].start, here[1].start
            nodes = (i + first_i) * self.height + j + first_j
            others = self.neighbours[nodes, link]
            self.costs_m[nodes, link] = costs_m
            self.costs_m[others, link + _LINKS] = costs_m
            changed += [nodes, others]

        self._weights[:] = network.weights
        touched = np.unique(np.concatenate(changed))
        self.is_linked[touched] = np.isfinite(self.costs_m[touched]).any(axis=1)
        return touched

    def node(self, cell: Cell) -> int:
        """The node of a cell of the map that lies inside."""
        i = cell[0] - self.origin[0]
        j = cell[1] - self.origin[1]
        return i * self.height + j

    def cells(self, nodes: Indices) -> Indices:
        """(k, 2): the cells of the map of nodes."""
        return self._cells.take(nodes, axis=0)

    def graph(self) -> SlotGraph:
        """The graph of the links, which has their updates too."""
        return SlotGraph(self.neighbours, self.costs_m)

    def matrix(self) -> sparse.csr_matrix:
        """(n, n): the costs of all links, those that are cut among them; it shares their memory."""
        starts = np.arange(0, self.count * SLOTS + 1, SLOTS, dtype=np.int32)
        entries = (self.costs_m.ravel(), self.neighbours.ravel(), starts)
        return sparse.csr_matrix(entries, shape=(self.count, self.count))


def link_costs_m(weights: Singles, length_m: float) -> Floats:
    """The cost of links of one length: that over the weight, inf where a link is cut.

    No link costs less than its length.
    """
    costs_m = np.full(weights.shape, np.inf)
    at_most_one = np.minimum(weights, 1, dtype=np.float64)
    np.divide(length_m, at_most_one, out=costs_m, where=weights > 0)
    rounded: Floats = np.ceil(costs_m / COST_UNIT_M) * COST_UNIT_M
    return rounded


def octile(i: npt.ArrayLike, j: npt.ArrayLike) -> Floats:
    """The length in cells of the shortest route over a free grid, by (i, j) from end to end."""
    along_i = np.abs(i)
    along_j = np.abs(j)
    diagonal = np.minimum(along_i, along_j)
    length: Floats = np.maximum(along_i, along_j) + (math.sqrt(2) - 1) * diagonal
    return length


def _padded(cells: int) -> int:
    """The side of a grid in whole blocks, with at least one blocked cell at its end."""
    return (cells // BLOCK + 1) * BLOCK


def _ends(shape: tuple[int, int], offset: Cell) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """The cells of a grid that have a neighbour at `offset`, and those neighbours."""
    width, height = shape
    di, dj = offset
    here = slice(max(0, -di), width - max(0, di)), slice(0, height - dj)
    there = slice(max(0, di), width + min(0, di)), slice(dj, height)
    return here, there
