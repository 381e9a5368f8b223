"""Activation that spreads within some nodes alone, so that it need not reach the whole network."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Floats, Indices
from services.codelets.planning.links import MAX_COST_M, OUTSIDE, SLOTS, Links, Rows
from services.codelets.planning.network import NEIGHBOUR_OFFSETS


class CorridorField(NamedTuple):
    """Activation within some nodes: row r of the arrays is of node `nodes[r]`.

    `distance_m`: (n + 1,) from the goal, inf where no activation arrives. `rows`: (n, SLOTS), of the
    neighbours; those of nodes outside are n. `costs_m`: (n, SLOTS), of the links to them.
    """

    nodes: Indices
    distance_m: Floats
    rows: Rows
    costs_m: Floats

    def distance_to(self, node: int) -> float:
        """The distance of one of the nodes from the goal."""
        return float(self.distance_m[self._row(node)])

    def climb(self, start: int) -> Indices:
        """The nodes from `start`, at which activation arrives, up its gradient to the goal.

        Of equal neighbours the first in the order of NEIGHBOUR_OFFSETS is taken.
        """
        row = self._row(start)
        route = [row]
        while self.distance_m[row] > 0:
            neighbours = self.rows[row]
            through_m = self.distance_m[neighbours] + self.costs_m[row]
            row = int(neighbours[through_m.argmin()])
            route.append(row)

        return self.nodes[route]

    def climb_short(self, start: int) -> Indices:
        """The same, faster where nodes are not many more than the route has."""
        through_m = self.distance_m.take(self.rows) + self.costs_m
        best = through_m.argmin(axis=1)
        upward = self.rows[np.arange(len(best)), best].tolist()

        row = self._row(start)
        goal = int(self.distance_m.argmin())
        route = [row]
        while row != goal:
            row = upward[row]
            route.append(row)

        return self.nodes.take(route)

    def _row(self, node: int) -> int:
        return int(self.nodes.searchsorted(node))


class Corridor:
    """Spreads activation within nodes of a network, however often."""

    def __init__(self, links: Links) -> None:
        self._links = links
        self._offsets = (NEIGHBOUR_OFFSETS @ (links.height, 1)).astype(np.int32)
        self._row_of = np.full(links.count, OUTSIDE, np.int32)

    def spread(self, nodes: Indices, goal: int) -> CorridorField:
        """The activation that spreads from `goal` within ascending `nodes`, it among them."""
        count = len(nodes)
        self._row_of[nodes] = np.arange(count, dtype=np.int32)
        rows = self._row_of.take(nodes[:, None] + self._offsets)
        goal_row = int(self._row_of[goal])
        self._row_of[nodes] = OUTSIDE

        # All nodes outside are one row, from which nothing spreads.
        np.minimum(rows, count, out=rows)
        costs_m = self._links.costs_m.take(nodes, axis=0)
        starts = np.arange(0, (count + 2) * SLOTS, SLOTS, dtype=np.int32)
        starts[-1] = starts[-2]
        parts = (costs_m.ravel(), rows.ravel(), starts)
        matrix = sparse.csr_matrix(parts, shape=(count + 1, count + 1))

        distance_m = dijkstra(matrix, indices=goal_row, limit=MAX_COST_M)
        distance_m[count] = math.inf
        return CorridorField(nodes, distance_m, rows, costs_m)
