"""Graphs whose nodes have a fixed number of slots for links, and activation within a part of one.

A part takes a few array operations to cut out, so a search pays for the part alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Floats, Indices

Numbers = npt.NDArray[np.int32]

# A limit that keeps a search from following links that are cut, whose cost is infinite.
MAX_COST_M = float(np.finfo(np.float64).max)
# All nodes outside a part are this row of it, from which nothing spreads.
_OUTSIDE = 0


class SlotGraph:
    """Nodes numbered from 0, each with links in slots.

    `neighbours`: (n, slots), the nodes that links lead to. `costs_m`: (n, slots), inf where a slot
    is empty or its link cut.
    """

    def __init__(self, neighbours: Numbers, costs_m: Floats) -> None:
        count, slots = neighbours.shape
        self.neighbours = neighbours
        self.costs_m = costs_m
        self._row_of = np.full(count, _OUTSIDE, np.int32)
        self._numbers = np.arange(1, count + 1, dtype=np.int32)

        # The first row, which is all that lies outside, has no links.
        starts = np.arange(-slots, slots * count + 1, slots, dtype=np.int32)
        starts[0] = 0
        self._starts = starts

    def part(self, nodes: Indices) -> Part:
        """The part of the graph that consists of `nodes`, which are ascending."""
        count = len(nodes)
        self._row_of[nodes] = self._numbers[:count]
        rows = self._row_of.take(self.neighbours.take(nodes, axis=0))
        self._row_of[nodes] = _OUTSIDE

        costs_m = self.costs_m.take(nodes, axis=0)
        entries = (costs_m.ravel(), rows.ravel(), self._starts[: count + 2])
        matrix = sparse.csr_matrix(entries, shape=(count + 1, count + 1))
        return Part(nodes, rows, costs_m, matrix)


class Part(NamedTuple):
    """A part of a graph: `nodes[r]`, ascending, is row r + 1 of `matrix`.

    `rows`: (n, slots), the rows of neighbours. `costs_m`: (n, slots), of the links to them.
    """

    nodes: Indices
    rows: Numbers
    costs_m: Floats
    matrix: sparse.csr_matrix

    def row(self, node: int) -> int:
        """The row of one of the nodes."""
        return int(self.nodes.searchsorted(node)) + 1

    def route(self, start: int, goal: int) -> Indices | None:
        """The nodes on a cheapest route; None where the part holds none."""
        row = self.row(start)
        goal_row = self.row(goal)
        distance_m, upward = dijkstra(
            self.matrix, indices=goal_row, limit=MAX_COST_M, return_predecessors=True
        )
        if not math.isfinite(distance_m[row]):
            return None

        route = [row - 1]
        while row != goal_row:
            row = int(upward[row])
            route.append(row - 1)

        return self.nodes.take(route)

    def distances_m(self, goal: int) -> Floats:
        """(n + 1,): the distance of each row from `goal`, inf where no activation arrives."""
        distance_m: Floats = dijkstra(self.matrix, indices=self.row(goal), limit=MAX_COST_M)
        distance_m[_OUTSIDE] = math.inf
        return distance_m

    def climb(self, distance_m: Floats, start: int) -> Indices:
        """The nodes from `start`, at which activation arrives, up its gradient to the goal.

        Of equal neighbours the one in the first slot is taken.
        """
        row = self.row(start)
        route = [row - 1]
        while distance_m[row] > 0:
            neighbours = self.rows[row - 1]
            through_m = distance_m[neighbours] + self.costs_m[row - 1]
            row = int(neighbours[through_m.argmin()])
            route.append(row - 1)

        return self.nodes.take(route)

    def climb_all(self, distance_m: Floats, start: int) -> Indices:
        """What `climb` returns, faster where few nodes are not on the route."""
        through_m = distance_m.take(self.rows)
        through_m += self.costs_m
        best = through_m.argmin(axis=1)
        upward = self.rows[np.arange(len(best)), best].tolist()
        goal_row = int(distance_m.argmin())

        row = self.row(start)
        route = [row - 1]
        while row != goal_row:
            row = upward[row - 1]
            route.append(row - 1)

        return self.nodes.take(route)
