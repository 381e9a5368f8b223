"""A path whose loops are closed, headings and all, ready to take in one more closure in no time."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats
from services.codelets.correction.least_squares import (
    MOST_ITERATIONS,
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
ITERATIONS_A_CLOSURE = 10


class IncrementalSolver:
    """The factors of a path's normal equations, and the closures since, each of which changes them
    a little.

    A closure adds three columns (Woodbury's identity), and one step corrects the path: its turns
    are small. Where eq. 7 then shows that they were not, the path is solved and factored anew, in
    bounded time: what some iterations leave undone is left to the next closures, and to `relinearize`.
    """

    def __init__(self, graph: PoseGraph) -> None:
        self._relinearize(graph)

    def _relinearize(self, graph: PoseGraph, most_iterations: int = MOST_ITERATIONS) -> None:
        poses = optimize(graph, most_iterations)
        self.graph = PoseGraph(poses, graph.steps, graph.closures)
        constraints = self.graph.constraints
        self._normal = NormalEquations(len(poses), constraints)
        self._factors = factor(self._normal.matrix(poses, constraints))
        self._cost = cost(poses, constraints)
        self._update_columns: list[Floats] = []

    def relinearize(self) -> None:
        """Take the closures that have come into the factors: for when there is time."""
        self._relinearize(self.graph)

    def chi_square(self, closure: Constraints) -> float:
        """How badly one closure fits all that is known without it; its degrees of freedom are what
        it tells of.
        """
        return self._fit(closure)[1]

    def add(self, closure: Constraints) -> Floats:
        """Take in one more closure: the (n, 3) poses after it."""
        step, chi_square, columns = self._fit(closure)
        graph = self.graph
        poses = self._normal.moved(graph.poses, -step)
        self.graph = PoseGraph(poses, graph.steps, graph.closures + closure)
        self._update_columns.append(columns)
        self._cost += chi_square
        if cost(poses, self.graph.constraints) > (1 + TOLERANCE) * self._cost:
            self._relinearize(self.graph, ITERATIONS_A_CLOSURE)
        return self.graph.poses

    def _fit(self, closure: Constraints) -> tuple[Floats, float, Floats]:
        """The step that takes `closure` in, its chi-square, and by what the path answers less once
        it is in.
        """
        root = sqrt_information(closure.information)[0]
        pulls = np.zeros((3 * (len(self.graph.poses) - 1), 3))
        used = []
        for end, by_end in zip(
            (closure.i, closure.j), jacobians(self.graph.poses, closure), strict=True
        ):
            unknowns, free = self._normal.unknowns(end)
            if free[0]:
                pulls[unknowns[0]] = by_end[0].T @ root
                used += unknowns[0].tolist()
        answers = self._factors.solve(pulls)
        for columns in self._update_columns:
            answers -= columns @ (columns[used].T @ pulls[used])
        left = np.linalg.cholesky(np.eye(3) + pulls[used].T @ answers[used])
        columns = np.linalg.solve(left, answers.T).T
        off = np.linalg.solve(left, root.T @ residuals(self.graph.poses, closure)[0])
        return columns @ off, float(off @ off), columns
