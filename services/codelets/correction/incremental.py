"""An optimized pose graph that takes in one more closure at little cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from services.codelets.correction.least_squares import (
    MAX_ITERATIONS,
    NormalEquations,
    factor,
    optimize,
)
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    cost,
    jacobians,
    residuals,
    sqrt_information,
)

TOLERANCE = 0.01
ITERATIONS_PER_CLOSURE = 10


class _Update(NamedTuple):
    """What one closure changes: `step` (u,) of the unknowns, and the columns (u, 3) by which
    solutions of the normal equations shrink once it is in. `chi_square` is its misfit.
    """

    step: Floats
    chi_square: float
    columns: Floats


class IncrementalSolver:
    """The factors of a path's normal equations, and the updates by the closures since.

    A closure adds three columns by Woodbury's identity, and one Gauss-Newton step corrects the
    path, for its turns are small. Where the cost of eq. 7 shows that they were not, the path is
    optimized and factored anew, in bounded time: what some iterations leave undone is left to the
    next closures and to `relinearize`.
    """

    def __init__(self, graph: PoseGraph) -> None:
        self._relinearize(graph)

    def _relinearize(self, graph: PoseGraph, max_iterations: int = MAX_ITERATIONS) -> None:
        poses = optimize(graph, max_iterations)
        self.graph = PoseGraph(poses, graph.steps, graph.closures)
        constraints = self.graph.constraints

        self._normal = NormalEquations(len(poses), constraints)
        self._factors = factor(self._normal.matrix(poses, constraints))
        self._cost = cost(poses, constraints)
        self._update_columns: list[Floats] = []

    def relinearize(self) -> None:
        """Optimize and factor with all closures so far: for when there is time."""
        self._relinearize(self.graph)

    def chi_square(self, closure: Constraints) -> float:
        """The squared Mahalanobis distance of one closure from what the others predict of it."""
        return self._update(closure).chi_square

    def add(self, closure: Constraints) -> Floats:
        """Take in one more closure. Returns the (n, 3) poses after it."""
        graph = self.graph
        update = self._update(closure)

        poses = self._normal.moved(graph.poses, -update.step)
        self.graph = PoseGraph(poses, graph.steps, graph.closures + closure)
        self._update_columns.append(update.columns)

        self._cost += update.chi_square
        if cost(poses, self.graph.constraints) > (1 + TOLERANCE) * self._cost:
            self._relinearize(self.graph, ITERATIONS_PER_CLOSURE)
        return self.graph.poses

    def _update(self, closure: Constraints) -> _Update:
        root = sqrt_information(closure.information)[0]
        columns, used = self._columns(closure, root)
        solved = self._solve(columns, used)

        gram = columns[used].T @ solved[used]
        left = np.linalg.cholesky(np.eye(3) + gram)
        update_columns = np.linalg.solve(left, solved.T).T

        whitened = root.T @ residuals(self.graph.poses, closure)[0]
        misfit = np.linalg.solve(left, whitened)
        return _Update(update_columns @ misfit, float(misfit @ misfit), update_columns)

    def _columns(self, closure: Constraints, root: Floats) -> tuple[Floats, Indices]:
        """(u, 3): the closure's whitened Jacobian, transposed, and which of its rows are used."""
        columns = np.zeros((3 * (len(self.graph.poses) - 1), 3))
        used = [np.zeros(0, np.int64)]
        by_i, by_j = jacobians(self.graph.poses, closure)

        for end, by_end in ((closure.i, by_i), (closure.j, by_j)):
            unknowns, free = self._normal.unknowns(end)
            if free[0]:
                columns[unknowns[0]] = by_end[0].T @ root
                used.append(unknowns[0])
        return columns, np.concatenate(used)

    def _solve(self, columns: Floats, used: Indices) -> Floats:
        """(u, 3): the solution of the normal equations, all closures so far included."""
        solved = self._factors.solve(columns)
        for update in self._update_columns:
            solved -= update @ (update[used].T @ columns[used])
        return np.asarray(solved, np.float64)
