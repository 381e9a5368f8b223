"""A path whose loops are closed, headings and all, ready to take in one more closure in no time."""

from __future__ import annotations

import numpy as np

from services.codelets.correction.least_squares import (
    MOST_ITERATIONS,
    NormalEquations,
    correct_headings,
    factor,
)
from services.codelets.correction.pose_graph import (
    Constraints,
    Floats,
    PoseGraph,
    cost,
    discrepancies,
    jacobians,
    roots,
)

TOLERANCE = 0.01
ITERATIONS_A_CLOSURE = 10


class Solved:
    """The factors of a path's normal equations, and the closures since, each of which changes them
    a little.

    A closure adds three columns (Woodbury's identity), and one step corrects the path: its turns
    are small. Where eq. 7 then shows that they were not, the path is solved and factored anew, in
    bounded time: what some iterations leave undone is left to the next closures, and to `settle`.
    """

    def __init__(self, graph: PoseGraph) -> None:
        self._settle(graph)

    def _settle(self, graph: PoseGraph, most_iterations: int = MOST_ITERATIONS) -> None:
        poses = correct_headings(graph, most_iterations)
        self.graph = PoseGraph(poses, graph.steps, graph.closures)
        constraints = self.graph.constraints
        self._normal = NormalEquations(len(poses), constraints)
        self._factors = factor(self._normal.matrix(poses, constraints))
        self._cost = cost(poses, constraints)
        self._stiffer: list[Floats] = []

    def settle(self) -> None:
        """Take the closures that have come into the factors: for when there is time."""
        self._settle(self.graph)

    def chi_square(self, closure: Constraints) -> float:
        """How badly one closure fits all that is known without it; its degrees of freedom are what
        it tells of.
        """
        return self._fit(closure)[1]

    def close(self, closure: Constraints) -> Floats:
        """Take in one more closure: the (n, 3) poses after it."""
        step, chi_square, stiffer = self._fit(closure)
        graph = self.graph
        poses = self._normal.moved(graph.poses, -step)
        self.graph = PoseGraph(poses, graph.steps, graph.closures + closure)
        self._stiffer.append(stiffer)
        self._cost += chi_square
        if cost(poses, self.graph.constraints) > (1 + TOLERANCE) * self._cost:
            self._settle(self.graph, ITERATIONS_A_CLOSURE)
        return self.graph.poses

    def _fit(self, closure: Constraints) -> tuple[Floats, float, Floats]:
        """The step that takes `closure` in, its chi-square, and by what the path answers less once
        it is in.
        """
        root = roots(closure.information)[0]
        pulls = np.zeros((3 * (len(self.graph.poses) - 1), 3))
        used = []
        for end, by_end in zip(
            (closure.first, closure.second), jacobians(self.graph.poses, closure), strict=True
        ):
            unknowns, free = self._normal.unknowns(end)
            if free[0]:
                pulls[unknowns[0]] = by_end[0].T @ root
                used += unknowns[0].tolist()
        answers = self._factors.solve(pulls)
        for stiffer in self._stiffer:
            answers -= stiffer @ (stiffer[used].T @ pulls[used])
        left = np.linalg.cholesky(np.eye(3) + pulls[used].T @ answers[used])
        stiffer = np.linalg.solve(left, answers.T).T
        off = np.linalg.solve(left, root.T @ discrepancies(self.graph.poses, closure)[0])
        return stiffer @ off, float(off @ off), stiffer
