"""The most probable path of eq. 7 by Gauss-Seidel iteration (paper §5.6): positions only, one after
the other, by alternating forward and backward passes over the path.

It is the reference that the paper names beside reverse replay. Each position in turn moves to where
its own constraints agree best with the positions beside it, as they are by then. How the paper's
supplement needs but a few passes we do not know: so there are passes over the loops, too, of which
each in turn takes the force that closes it, while all steps of the path yield.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve, spsolve_triangular

from cogmap.estimation.pose_graph import PoseGraph, matvec
from cogmap.estimation.reverse_replay import Loops, displacements
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import cumulative


class NormalEquations:
    """Eq. 7 of a path as H x = b, for all positions but the first, which stays. The headings are
    those of `graph.poses`.
    """

    def __init__(self, graph: PoseGraph) -> None:
        constraints = graph.constraints
        known = displacements(graph.poses, constraints)
        weight = np.asarray(np.linalg.inv(known.covariance_m2), np.float64)
        pull = matvec(weight, known.offset_m)
        count = len(graph.poses)
        self._start_m = graph.poses[0, :2]

        whole = _placed(constraints.i, constraints.i, weight, count)
        whole += _placed(constraints.j, constraints.j, weight, count)
        whole -= _placed(constraints.i, constraints.j, weight, count)
        whole -= _placed(constraints.j, constraints.i, weight, count)

        right = np.zeros((count, 2))
        np.add.at(right, constraints.j, pull)
        np.add.at(right, constraints.i, -pull)

        self._matrix = whole[2:, 2:].tocsr()
        self._right = right.ravel()[2:] - whole[2:, :2] @ self._start_m
        self._below = sparse.tril(self._matrix, -1, "csr")
        self._above = sparse.triu(self._matrix, 1, "csr")
        self._lower = sparse.tril(self._matrix, 0, "csr")
        self._upper = sparse.triu(self._matrix, 0, "csr")

    def solve(self) -> Floats:
        """Return the (n, 2) positions of the least cost."""
        return self._with_start(spsolve(self._matrix.tocsc(), self._right))

    def forward(self, positions_m: Floats) -> Floats:
        """Pass once over (n, 2) positions from the first to the last."""
        later = self._right - self._above @ positions_m[1:].ravel()
        return self._with_start(spsolve_triangular(self._lower, later, lower=True))

    def backward(self, positions_m: Floats) -> Floats:
        """Pass once over (n, 2) positions from the last to the first."""
        earlier = self._right - self._below @ positions_m[1:].ravel()
        return self._with_start(spsolve_triangular(self._upper, earlier, lower=False))

    def _with_start(self, unknown: Floats) -> Floats:
        return np.vstack([self._start_m, unknown.reshape(-1, 2)])


def integrated_m(graph: PoseGraph) -> Floats:
    """Return the (n, 2) positions by path integration alone, with the headings of the poses."""
    steps = displacements(graph.poses, graph.steps)
    positions_m: Floats = graph.poses[0, :2] + cumulative(steps.offset_m)
    return positions_m


def passes(graph: PoseGraph) -> Iterator[Floats]:
    """Yield the (n, 2) positions after each pass over the path, the first forwards, from path
    integration alone.
    """
    equations = NormalEquations(graph)
    positions_m = integrated_m(graph)
    while True:
        positions_m = equations.forward(positions_m)
        yield positions_m

        positions_m = equations.backward(positions_m)
        yield positions_m


def loop_passes(graph: PoseGraph) -> Iterator[Floats]:
    """Yield the (n, 2) positions after each pass over the closures, the first in the order of their
    ends, the next backwards, from path integration alone.
    """
    loops = Loops(graph)
    forces = np.zeros((len(graph.closures), 2))
    ends = np.maximum(graph.closures.i, graph.closures.j)
    order = np.argsort(ends, kind="stable").tolist()
    while True:
        for number in order:
            left_m = loops.discrepancy_m[number] - loops.yielded(forces)[number]
            forces[number] += loops.gain[number] @ left_m

        yield loops.positions_m(forces)
        order.reverse()


def _placed(rows: Indices, columns: Indices, blocks: Floats, count: int) -> sparse.csr_matrix:
    """Sum (m, 2, 2) blocks at these places of a matrix of count x count blocks."""
    at_row = np.broadcast_to(2 * rows[:, None, None] + np.array([[0], [1]]), blocks.shape)
    at_column = np.broadcast_to(2 * columns[:, None, None] + np.array([[0, 1]]), blocks.shape)
    places = (at_row.ravel(), at_column.ravel())
    return sparse.csr_matrix((blocks.ravel(), places), shape=(2 * count, 2 * count))
