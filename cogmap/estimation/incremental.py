"""An optimized pose graph that takes in one more closure at little cost."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cogmap.estimation.least_squares import (
    MAX_ITERATIONS,
    NormalEquations,
    factor,
    optimize,
)
from cogmap.estimation.pose_graph import (
    Constraints,
    PoseGraph,
    cost,
    jacobians,
    residuals,
    sqrt_information,
)
from cogmap.geometry.arrays import Floats, Indices

# If the cost exceeds its prediction by a larger share, so many iterations at most correct the path.
TOLERANCE = 0.01
ITERATIONS_PER_CLOSURE = 10


class _Update(NamedTuple):
    """The change by one closure: `step` (u,) of the unknowns, and the columns (u, 3) by which
    solutions of the normal equations shrink once it is in. `chi_square` is its misfit.
    """

    step: Floats
    chi_square: float
    columns: Floats


class IncrementalSolver:
    """The factors of a path's normal equations, and the updates by the closures since.

    A closure adds three columns by Woodbury's identity, and one Gauss-Newton step corrects the
    path, for its turns are small. If the cost of eq. 7 shows that they were not, the path is
    optimized and factored anew, in bounded time: what some iterations leave undone is left to the
    next closures and to `relinearize`.
    """

    def __init__(self, graph: PoseGraph) -> None:
        self._relinearize(graph)

    def _relinearize(self, graph: PoseGraph, max_iterations: int = MAX_ITERATIONS) -> None:
        constraints = graph.constraints
        self._normal = NormalEquations(len(graph.poses), constraints)
        poses = optimize(graph, max_iterations, self._normal)
        self.graph = replace(graph, poses=poses)

        matrix = self._normal.matrix(poses, constraints)
        self._factors = factor(matrix)

        self._cost = cost(poses, constraints)
        self._update_columns: list[Floats] = []

    def relinearize(self) -> None:
        """Optimize and factor with all closures so far: for when there is time."""
        self._relinearize(self.graph)

    @property
    def cost(self) -> float:
        """Return the cost of the path: after `add`, as linear updates predict it."""
        return self._cost

    def chi_square(self, closure: Constraints) -> float:
        """Return one closure's squared Mahalanobis distance from what the others predict of it."""
        return self._update(closure).chi_square

    def add(self, closure: Constraints) -> Floats:
        """Take in one more closure. Returns the (n, 3) poses after it."""
        graph = self.graph
        update = self._update(closure)
        self._update_columns.append(update.columns)

        poses = self._normal.moved(graph.poses, -update.step)
        closures = graph.closures + closure
        self.graph = replace(graph, poses=poses, closures=closures)

        # The cost of the path may be above what the linear updates predict.
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

        residual = residuals(self.graph.poses, closure)[0]
        whitened = root.T @ residual
        misfit = np.linalg.solve(left, whitened)

        return _Update(
            step=update_columns @ misfit,
            chi_square=float(misfit @ misfit),
            columns=update_columns,
        )

    def _columns(self, closure: Constraints, root: Floats) -> tuple[Floats, Indices]:
        """Return the closure's whitened Jacobian, transposed, (u, 3), and which rows are used."""
        by_i, by_j = jacobians(self.graph.poses, closure)

        columns = np.zeros((self._normal.unknown_count, 3))
        used = [np.zeros(0, np.int64)]
        for end, by_end in ((closure.i, by_i), (closure.j, by_j)):
            unknowns, is_free = self._normal.unknowns(end)
            if is_free[0]:
                rows = unknowns[0]
                columns[rows] = by_end[0].T @ root
                used.append(rows)

        return columns, np.concatenate(used)

    def _solve(self, columns: Floats, used: Indices) -> Floats:
        """Solve the normal equations for (u, 3) `columns`, with all closures so far included."""
        used_columns = columns[used]
        solved = self._factors.solve(columns)
        for update in self._update_columns:
            overlap = update[used].T @ used_columns
            solved -= update @ overlap

        return np.asarray(solved, np.float64)
