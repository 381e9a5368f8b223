"""Loop closures that state the same, judged as one hypothesis against all else that is known
(beyond the paper).

Two streets that look alike give closures that agree with one another: many as they are, they are
all mistaken at once. What all others contradict once it is left out is rejected.

The path's fit sets the tolerance for closures. If it fits better than its information states, that
is understated, and a false closure would seem possible that is not. The variance
factor (a posteriori variance of unit weight: the least cost over the degrees of freedom) scales it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree
from scipy.special import chdtri

from cogmap.estimation.covariance import joint_covariances
from cogmap.estimation.incremental import IncrementalSolver
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import (
    Constraints,
    PoseGraph,
    cost,
    jacobians,
    matvec,
    residuals,
    sqrt_information,
)
from cogmap.geometry.arrays import Booleans, Floats, Indices

# In places of the path, at either end of a closure.
SAME_PLACES = 5
# A path that a false hypothesis has bent is far from linear: so many in a row, of those that seem
# most doubtful, must hold when it is solved again without them.
DOUBTED = 3
# What the information states of a pose counts as much as one more hypothesis that fits as stated.
STATED_DEGREES = 3


class Hypotheses:
    """The closures of a path by what they state: those that lead from within SAME_PLACES of one
    place to within as many of another are one hypothesis.

    A true closure exceeds `threshold` (m,), in squared Mahalanobis distance, with probability
    `false_closure`.
    """

    def __init__(self, graph: PoseGraph, false_closure: float) -> None:
        self._graph = graph
        self._false_closure = false_closure
        self._degrees = _degrees(graph.closures)
        self.threshold: Floats = chdtri(self._degrees, false_closure)
        self._support = _sizes(_alike(graph.closures))

    @property
    def shares(self) -> Floats:
        """Return the weights (m,) by which each hypothesis counts once."""
        shares: Floats = 1 / self._support
        return shares

    def settled(self, accepted: Booleans) -> Booleans:
        """Mark the closures that hold, (m,), given those `accepted` so far: none that all others
        contradict, and all that agree with all others.
        """
        remaining, factor = self._without_contradicted(accepted)
        solver = IncrementalSolver(self._with(remaining))
        result = remaining.copy()

        # Outliers may agree with all inliers: the path between the two may be long and uncertain.
        # What most closures state comes first.
        order = np.argsort(-self._support, kind="stable")
        for number in order[~remaining[order]].tolist():
            if self._misfit(solver, number) <= factor:
                solver.add(self._graph.closures.select(np.array([number])))
                result[number] = True

        return result

    def truncated_cost(self, accepted: Booleans) -> float:
        """Return the cost that truncated least squares minimizes: that of the path by the accepted
        closures, plus the thresholds of all other closures, with each hypothesis counted once.
        """
        closures = self._graph.closures.weighted(self.shares).select(accepted)
        graph = self._graph.with_closures(closures)
        path_cost = cost(optimize(graph), graph.constraints)

        truncated = (self.shares * self.threshold)[~accepted]
        return path_cost + float(truncated.sum())

    def _without_contradicted(self, accepted: Booleans) -> tuple[Booleans, float]:
        """Drop every hypothesis that all others contradict. Return which closures remain, (m,), and
        the variance factor by those.
        """
        remaining = accepted
        factor = 1.0
        while remaining.any():
            solver = IncrementalSolver(self._with(remaining))
            factor = self._variance_factor(solver, remaining)
            before = remaining
            not_contradicted = 0
            for members in _by_doubt(solver.graph, np.flatnonzero(remaining)):
                others = remaining.copy()
                others[members] = False

                # Does the path by the others contradict the hypothesis, by its middle closure?
                middle = members[len(members) // 2]
                if self._misfit(IncrementalSolver(self._with(others)), middle) > factor:
                    remaining = others
                    not_contradicted = 0
                else:
                    not_contradicted += 1
                if not_contradicted == DOUBTED:
                    break

            if remaining.sum() == before.sum():
                break

        return remaining, factor

    def _misfit(self, solver: IncrementalSolver, number: int) -> float:
        """Return a closure's squared distance from what the solver predicts, over its threshold."""
        closure = self._graph.closures.select(np.array([number]))
        return solver.chi_square(closure) / float(self.threshold[number])

    def _variance_factor(self, solver: IncrementalSolver, accepted: Booleans) -> float:
        """Estimate by what factor the variances of a path by the accepted closures are less than
        stated: 1 if they are not, or if there are too few hypotheses to know.

        It is the greatest factor that the cost allows for, except with probability `false_closure`.
        Closures of one hypothesis may err alike: together they have the degrees of freedom of one.
        """
        closures = self._graph.closures.select(accepted)
        shares = 1 / _sizes(_alike(closures))
        degrees = float(self._degrees[accepted] @ shares)

        least_cost = float(chdtri(degrees, 1 - self._false_closure))
        return min(1.0, (STATED_DEGREES + solver.cost) / least_cost)

    def _with(self, accepted: Booleans) -> PoseGraph:
        """Return the path with the accepted closures alone."""
        closures = self._graph.closures.select(accepted)
        return self._graph.with_closures(closures)


def _degrees(closures: Constraints) -> Floats:
    """Count the degrees of freedom of each closure, (m,): the rank of its information."""
    eigenvalues = np.linalg.eigvalsh(closures.information)
    largest = eigenvalues[:, -1:]
    is_measured = eigenvalues > 1e-9 * largest

    degrees: Floats = is_measured.sum(axis=1).astype(np.float64)
    return degrees


def _alike(closures: Constraints) -> list[list[int]]:
    """List for each of m closures those that state the same, itself among them."""
    ends = np.column_stack([closures.i, closures.j]).astype(np.float64)
    tree = KDTree(ends)

    alike: list[list[int]] = tree.query_ball_point(
        ends, SAME_PLACES, p=np.inf, return_sorted=True
    ).tolist()
    return alike


def _sizes(groups: list[list[int]]) -> Floats:
    sizes = [len(group) for group in groups]
    return np.array(sizes, np.float64)


def _by_doubt(graph: PoseGraph, numbers: Indices) -> list[Indices]:
    """Sort the hypotheses among the closures of an optimized graph, whose `numbers` (k,) are given:
    first comes the one that all others predict the least, linearly.
    """
    groups: list[Indices] = []
    is_listed = np.zeros(len(numbers), bool)
    for index, group in enumerate(_alike(graph.closures)):
        if is_listed[index]:
            continue

        members = np.array(group)
        is_listed[members] = True
        groups.append(members)

    order = np.argsort(-_chi_squares_without(graph, groups), kind="stable")
    return [numbers[groups[index]] for index in order.tolist()]


def _chi_squares_without(graph: PoseGraph, groups: list[Indices]) -> Floats:
    """Return the squared Mahalanobis distance of each group of an optimized graph's closures, taken
    together, from what all others predict of them, (n,).
    """
    closures = graph.closures
    roots = sqrt_information(closures.information)
    by_i, by_j = jacobians(graph.poses, closures)
    whitened = matvec(roots.mT, residuals(graph.poses, closures))
    whitened_i = roots.mT @ by_i
    whitened_j = roots.mT @ by_j

    ends = [np.unique([closures.i[members], closures.j[members]]) for members in groups]
    found = np.zeros(len(groups))
    covariances = joint_covariances(graph, ends)
    for number, (members, poses) in enumerate(zip(groups, ends, strict=True)):
        rows = np.arange(len(members))
        by_poses = np.zeros((len(members), 3, len(poses), 3))
        by_poses[rows, :, np.searchsorted(poses, closures.i[members])] = whitened_i[members]
        by_poses[rows, :, np.searchsorted(poses, closures.j[members])] += whitened_j[members]

        joined = by_poses.reshape(3 * len(members), 3 * len(poses))
        leverage = joined @ covariances[number] @ joined.T
        misfit = whitened[members].ravel()
        is_free = np.eye(len(misfit)) - leverage
        found[number] = misfit @ np.linalg.solve(is_free, misfit)
    return found
