"""The links of a place network as costs, kept from one plan to the next.

A node has a slot for each of its eight links, so that a link that is cut or opened changes two
numbers. Nodes are numbered i * height + j, over a grid padded to whole blocks of the hierarchy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import sparse

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.graph.window import LINK_OFFSETS
from cogmap.services.codelets.planning.network import (
    NEIGHBOUR_OFFSETS,
    Cell,
    PlaceNetwork,
)
from cogmap.services.codelets.planning.search.slots import Numbers, SlotGraph

# Costs are multiples of this, so that their sums are exact and ties are ties on every machine.
COST_UNIT_M = 2.0**-20
# The edge of a block of the coarsest level of the hierarchy, in cells.
BLOCK = 9
SLOTS = len(NEIGHBOUR_OFFSETS)

Box = tuple[slice, slice]


class Direction(NamedTuple):
    """Links of one direction: those of the cells `here` of a grid to the cells `there`.

    `slot`: of these links at `here`; `opposite`: of the same links at `there`.
    """

    slot: int
    opposite: int
    length: float
    here: Box
    there: Box


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

        nodes = np.arange(self.count)
        i, j = np.divmod(nodes, self.height)
        self._cells: Indices = np.stack([i, j], axis=-1) + np.array(self.origin)
        self.neighbours = _neighbours(self.count, self.height)

        self._directions = _directions(width, height)
        self._weights = network.weights.copy()
        self.costs_m = self._costs_m()
        self.is_linked: Booleans = np.any(np.isfinite(self.costs_m), axis=1)

    def fits(self, network: PlaceNetwork) -> bool:
        """Whether a network has the same cells, so that this can be updated to it."""
        here = (self.origin, self.cell_m, self.shape)
        there = (network.origin, network.cell_m, network.shape)
        return here == there

    def update(self, network: PlaceNetwork) -> Indices:
        """Take the weights of `network`, which has the same cells.

        Returns the nodes with a link whose weight has changed, in ascending order.
        """
        changed = []
        for direction in self._directions:
            changed += self._update(network.weights, direction)

        nodes = np.unique(np.concatenate(changed))
        is_open = np.isfinite(self.costs_m[nodes])
        self.is_linked[nodes] = is_open.any(axis=1)
        self._weights[:] = network.weights
        return nodes

    def are_alike(self) -> bool:
        """Whether all links that are not cut have one weight."""
        is_open = self._weights > 0
        is_slow = self._weights < 1
        is_between = is_open & is_slow
        return not is_between.any()

    def contain(self, cell: Cell) -> bool:
        """Whether a cell of the map lies in the network."""
        i, j = self._index_of(cell)
        width, height = self.shape
        is_inside_i = 0 <= i < width
        is_inside_j = 0 <= j < height
        return is_inside_i and is_inside_j

    def node(self, cell: Cell) -> int:
        """The node of a cell of the map that lies in the network."""
        i, j = self._index_of(cell)
        return i * self.height + j

    def cells(self, nodes: Indices) -> Indices:
        """(k, 2): the cells of the map of nodes."""
        return self._cells.take(nodes, axis=0)

    def graph(self) -> SlotGraph:
        """The graph of the links, which shares their updates."""
        return SlotGraph(self.neighbours, self.costs_m)

    def matrix(self) -> sparse.csr_matrix:
        """(n, n): the costs of all links, those that are cut among them; it shares their memory."""
        starts = np.arange(self.count + 1, dtype=np.int32)
        starts *= SLOTS
        costs_m = self.costs_m.ravel()
        columns = self.neighbours.ravel()

        shape = (self.count, self.count)
        return sparse.csr_matrix((costs_m, columns, starts), shape=shape)

    def _index_of(self, cell: Cell) -> Cell:
        i, j = cell
        first_i, first_j = self.origin
        return i - first_i, j - first_j

    def _costs_m(self) -> Floats:
        """(n, SLOTS): what links cost by their weights."""
        costs_m = np.full((self.width, self.height, SLOTS), np.inf)
        at_slots = np.moveaxis(costs_m, -1, 0)

        for slot, opposite, length, here, there in self._directions:
            weights = self._weights[slot][here]
            of_links = link_costs_m(weights, length * self.cell_m)
            at_slots[slot][here] = of_links
            at_slots[opposite][there] = of_links

        return costs_m.reshape(self.count, SLOTS)

    def _update(self, weights: Singles, direction: Direction) -> list[Indices]:
        """Take the weights of links of one direction; returns the nodes at both their ends."""
        slot, opposite, length, here, _ = direction
        after = weights[slot][here]
        before = self._weights[slot][here]
        i, j = np.nonzero(after != before)
        of_links = link_costs_m(after[i, j], length * self.cell_m)

        along_i, along_j = here
        i += along_i.start
        j += along_j.start
        nodes = i * self.height + j
        others = self.neighbours[nodes, slot]
        self.costs_m[nodes, slot] = of_links
        self.costs_m[others, opposite] = of_links
        return [nodes, others]


def link_costs_m(weights: Singles, length_m: float) -> Floats:
    """The cost of links of one length: that over the weight, inf where a link is cut.

    No link costs less than its length.
    """
    at_most_one = np.minimum(weights, 1, dtype=np.float64)
    is_open = weights > 0

    costs_m = np.full(weights.shape, np.inf)
    np.divide(length_m, at_most_one, out=costs_m, where=is_open)
    return in_cost_units(costs_m)


def in_cost_units(costs_m: Floats) -> Floats:
    """Costs rounded up to multiples of COST_UNIT_M."""
    units = np.ceil(costs_m / COST_UNIT_M)
    rounded: Floats = units * COST_UNIT_M
    return rounded


def octile(i: npt.ArrayLike, j: npt.ArrayLike) -> Floats:
    """The length in cells of the shortest route over a free grid, by (i, j) from end to end."""
    along_i = np.abs(i)
    along_j = np.abs(j)
    longer = np.maximum(along_i, along_j)
    shorter = np.minimum(along_i, along_j)

    length: Floats = longer + (math.sqrt(2) - 1) * shorter
    return length


def _padded(cells: int) -> int:
    """The side of a grid in whole blocks, with at least one blocked cell at its end."""
    blocks = cells // BLOCK + 1
    return BLOCK * blocks


def _neighbours(count: int, height: int) -> Numbers:
    """(n, SLOTS): the neighbours of nodes; beyond the first or last column, a node of the padding
    on the other side, which is blocked.
    """
    nodes = np.arange(count)
    offsets = NEIGHBOUR_OFFSETS @ (height, 1)
    neighbours: Numbers = np.add.outer(nodes, offsets, dtype=np.int32)

    neighbours[neighbours < 0] += count
    neighbours[neighbours >= count] -= count
    return neighbours


def _directions(width: int, height: int) -> list[Direction]:
    """The directions of links on a grid, in the order of LINK_OFFSETS."""
    directions = []
    for slot, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        along_i = _ends(width, di)
        along_j = _ends(height, dj)
        here, there = zip(along_i, along_j, strict=True)

        opposite = slot + len(LINK_OFFSETS)
        direction = Direction(slot, opposite, math.hypot(di, dj), here, there)
        directions.append(direction)

    return directions


def _ends(count: int, step: int) -> tuple[slice, slice]:
    """The cells along one axis from which a step leads to another, and those others."""
    forth = max(step, 0)
    back = max(-step, 0)
    here = slice(back, count - forth)
    there = slice(forth, count - back)
    return here, there
