"""Graphs whose nodes have a fixed number of slots for links, and activation within a part of one.

A part takes a few array operations to cut out, so that a search pays for the part alone.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Booleans, Floats, Indices

Numbers = npt.NDArray[np.int32]

# A limit that keeps a search from following links that are cut, whose cost is infinite.
MAX_COST_M = float(np.finfo(np.float64).max)
# In the time of one step up a gradient, numpy computes it for so many nodes at once.
NODES_PER_STEP = 50
# The one row of a part that stands for all nodes outside, from which nothing spreads.
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
        self._rows = np.arange(1, count + 1, dtype=np.int32)

        self._starts = np.zeros(count + 2, np.int32)
        self._starts[2:] = slots * self._rows

    @cached_property
    def whole(self) -> Part:
        """All of the graph, as a part of it; costs that change later change there too."""
        count = len(self.neighbours)
        rows = self.neighbours + np.int32(1)
        entries = (self.costs_m.ravel(), rows.ravel(), self._starts)
        shape = (count + 1, count + 1)
        matrix = sparse.csr_matrix(entries, shape=shape)
        return Part(np.arange(count), rows, self.costs_m, matrix)

    def with_neighbours(self, nodes: Indices) -> Booleans:
        """(n,): which nodes are one of `nodes`, or a neighbour of one."""
        neighbours = self.neighbours.take(nodes, axis=0)
        is_near = np.zeros(len(self.neighbours), bool)
        is_near[nodes] = True
        is_near[neighbours] = True
        return is_near

    def part(self, nodes: Indices) -> Part:
        """The part of the graph that consists of `nodes`, which are ascending."""
        count = len(nodes)
        self._row_of[nodes] = self._rows[:count]
        neighbours = self.neighbours.take(nodes, axis=0)
        rows = self._row_of.take(neighbours)
        self._row_of[nodes] = _OUTSIDE

        costs_m = self.costs_m.take(nodes, axis=0)
        starts = self._starts[: count + 2]
        entries = (costs_m.ravel(), rows.ravel(), starts)
        shape = (count + 1, count + 1)
        matrix = sparse.csr_matrix(entries, shape=shape)
        return Part(nodes, rows, costs_m, matrix)


class Part(NamedTuple):
    """A part of a graph: `nodes[r]`, ascending, is row r + 1 of `matrix`.

    `rows`: (n, slots), those of neighbours. `costs_m`: (n, slots), of the links to them.
    """

    nodes: Indices
    rows: Numbers
    costs_m: Floats
    matrix: sparse.csr_matrix

    def row(self, node: int) -> int:
        """The row of one of the nodes."""
        index = int(self.nodes.searchsorted(node))
        return index + 1

    def route(self, start: int, goal: int) -> Indices | None:
        """The nodes on a cheapest route within the part; None where there is none."""
        row = self.row(start)
        goal_row = self.row(goal)
        distances_m, upward = dijkstra(
            self.matrix, indices=goal_row, limit=MAX_COST_M, return_predecessors=True
        )
        if not math.isfinite(distances_m[row]):
            return None

        indices = [row - 1]
        while row != goal_row:
            row = int(upward[row])
            indices.append(row - 1)

        return self.nodes.take(indices)

    def distances_m(self, goal: int) -> Floats:
        """(n + 1,): the distance of each row from `goal`, inf where no activation arrives."""
        distances_m: Floats = dijkstra(self.matrix, indices=self.row(goal), limit=MAX_COST_M)
        distances_m[_OUTSIDE] = math.inf
        return distances_m

    def climb(self, distances_m: Floats, start: int, steps: float) -> Indices:
        """The nodes from `start`, at which activation arrives, up its gradient to the goal.

        Of equal neighbours the one in the first slot is taken. `steps`: about how many the route
        has; where these are many of the part's nodes, the gradient is computed everywhere at once.
        """
        if steps * NODES_PER_STEP < len(self.nodes):
            indices = self._climb_step_by_step(distances_m, start)
        else:
            indices = self._climb_everywhere(distances_m, start)

        return self.nodes.take(indices)

    def _climb_step_by_step(self, distances_m: Floats, start: int) -> list[int]:
        row = self.row(start)
        indices = [row - 1]

        while distances_m[row] > 0:
            neighbours = self.rows[row - 1]
            through_m = distances_m[neighbours] + self.costs_m[row - 1]
            best = through_m.argmin()
            row = int(neighbours[best])
            indices.append(row - 1)

        return indices

    def _climb_everywhere(self, distances_m: Floats, start: int) -> list[int]:
        through_m = distances_m.take(self.rows)
        through_m += self.costs_m
        best = through_m.argmin(axis=1)
        every = np.arange(len(best))
        upward = self.rows[every, best].tolist()

        row = self.row(start)
        goal_row = int(distances_m.argmin())
        indices = [row - 1]
        while row != goal_row:
            row = upward[row - 1]
            indices.append(row - 1)

        return indices
