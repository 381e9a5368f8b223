"""Inliers among loop closures, by graduated non-convexity: a place taken for another must not bend
the map (beyond the paper).

Yang et al. 2020 (doi 10.1109/LRA.2020.2965893) on truncated least squares: at first every closure
has its full weight, and the weight of those that fit badly falls round by round, until each closure
is an inlier or an outlier.

Two streets that look alike give groups of closures that agree with one another. Closures from about
the same places to about the same places are one hypothesis, and pull as one. Each hypothesis is
then compared with all others, and last each outlier with all inliers.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree
from scipy.special import chdtri

from cogmap.geometry.arrays import Booleans, Floats
from services.codelets.correction.incremental import IncrementalSolver
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    mahalanobis2,
    residuals,
)

CONVEXITY_FACTOR = 1.4
MAX_ROUNDS = 60
MIN_WEIGHT = 1e-6
SAME_PLACES = 5
# So many hypotheses are compared with all others at a time.
COMPARED = 3


def inliers(graph: PoseGraph, false_closure: float) -> Booleans:
    """(m,): which closures of `graph` are inliers, headings included."""
    if not len(graph.closures):
        return np.zeros(0, bool)

    threshold = thresholds(graph.closures, false_closure)
    accepted = _by_weights(graph, threshold)
    accepted = _without_contradicted(graph, accepted, threshold)
    return _readmit(graph, accepted, threshold)


def thresholds(closures: Constraints, false_closure: float) -> Floats:
    """(m,): the squared Mahalanobis distance that a true closure exceeds with probability
    `false_closure`; its degrees of freedom are the rank of its information.
    """
    eigenvalues = np.linalg.eigvalsh(closures.information)
    largest = eigenvalues[:, -1:]
    is_measured = eigenvalues > 1e-9 * largest

    degrees = is_measured.sum(axis=1)
    threshold: Floats = chdtri(degrees, false_closure)
    return threshold


def _by_weights(graph: PoseGraph, threshold: Floats) -> Booleans:
    """(m,): which closures keep their weight."""
    shares = 1 / np.array([len(group) for group in _groups(graph.closures)])
    weights = np.ones(len(graph.closures))
    convexity = 0.0

    for _ in range(MAX_ROUNDS):
        excess = _excess(graph, weights * shares, threshold)
        if not convexity:
            worst = excess.max()
            if worst <= 1:
                break
            convexity = 1 / (2 * worst - 1)

        weights = _weights(excess, convexity)
        is_decided = (weights == MIN_WEIGHT) | (weights == 1.0)
        if is_decided.all():
            break
        convexity *= CONVEXITY_FACTOR

    return weights > 0.5


def _groups(closures: Constraints) -> list[list[int]]:
    """(m,): which closures, itself among them, state the same as each: those that lead from within
    SAME_PLACES of where it begins to within as many of where it ends.
    """
    ends = np.column_stack([closures.i, closures.j]).astype(np.float64)
    tree = KDTree(ends)
    groups: list[list[int]] = tree.query_ball_point(ends, SAME_PLACES, p=np.inf).tolist()
    return groups


def _without_contradicted(graph: PoseGraph, accepted: Booleans, threshold: Floats) -> Booleans:
    """(m,): which are still accepted once there is no hypothesis that all others contradict."""
    remaining = accepted.copy()
    while remaining.any():
        contradicted = _most_contradicted(graph, remaining, threshold)
        if not contradicted:
            break
        remaining[contradicted] = False

    return remaining


def _most_contradicted(graph: PoseGraph, accepted: Booleans, threshold: Floats) -> list[int]:
    """The accepted closures of the hypothesis that all others contradict most; none where they
    contradict none.

    A path that a false hypothesis has bent is far from linear: it is solved again without each of
    those that are most doubtful.
    """
    found: list[int] = []
    most = 1.0
    for group in _most_doubtful(graph, accepted):
        others = accepted.copy()
        others[group] = False
        solver = IncrementalSolver(graph.with_closures(graph.closures.select(others)))

        middle = group[len(group) // 2]
        closure = graph.closures.select(np.array([middle]))
        misfit = solver.chi_square(closure) / threshold[middle]
        if misfit > most:
            found = group
            most = misfit

    return found


def _most_doubtful(graph: PoseGraph, accepted: Booleans) -> list[list[int]]:
    """The COMPARED hypotheses of which all others predict the least, linearly."""
    numbers = np.flatnonzero(accepted)
    closures = graph.closures.select(numbers)
    solver = IncrementalSolver(graph.with_closures(closures))

    doubts: list[float] = []
    hypotheses: list[list[int]] = []
    is_listed = np.zeros(len(numbers), bool)
    for index, group in enumerate(_groups(closures)):
        if not is_listed[index]:
            is_listed[group] = True
            doubts.append(solver.chi_square_without(closures.select(np.array(group))))
            hypotheses.append(numbers[group].tolist())

    worst = np.argsort(doubts)[::-1][:COMPARED]
    return [hypotheses[index] for index in worst.tolist()]


def _excess(graph: PoseGraph, weights: Floats, threshold: Floats) -> Floats:
    """(m,): each closure's misfit of the path that so weighted ones lead to, over its threshold."""
    closures = graph.closures
    weighted = graph.with_closures(closures.weighted(weights))
    poses = optimize(weighted)

    residual = residuals(poses, closures)
    return mahalanobis2(residual, closures.information) / threshold


def _weights(excess: Floats, convexity: float) -> Floats:
    """The weights of the surrogate of truncated least squares."""
    squared = convexity * (convexity + 1) / excess.clip(1e-12)
    surrogate = np.sqrt(squared) - convexity
    return surrogate.clip(MIN_WEIGHT, 1.0)


def _readmit(graph: PoseGraph, accepted: Booleans, threshold: Floats) -> Booleans:
    """Accept outliers that agree with all inliers: the path between the two may be long and
    uncertain.
    """
    closures = graph.closures
    solver = IncrementalSolver(graph.with_closures(closures.select(accepted)))

    result = accepted.copy()
    for index in np.flatnonzero(~accepted):
        closure = closures.select(np.array([index]))
        if solver.chi_square(closure) <= threshold[index]:
            solver.add(closure)
            result[index] = True

    return result
