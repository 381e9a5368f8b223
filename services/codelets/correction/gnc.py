"""Which of the loops that were closed hold: a place taken for another must not bend the map (beyond
the paper).

Graduated non-convexity (Yang et al. 2020) on truncated least squares: at first every closure
counts, and those that fit badly count less and less, until each holds or does not. Those left out
are then held against all that hold.
"""

from __future__ import annotations

import numpy as np
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

STEEPER = 1.4
MOST_ROUNDS = 60
LEAST_WEIGHT = 1e-6


def limits(closures: Constraints, false_closure: float) -> Floats:
    """(m,): the chi-square that a true closure exceeds with probability `false_closure`."""
    known = np.linalg.eigvalsh(closures.information)
    degrees = (known > 1e-9 * known[:, -1:]).sum(axis=1)
    result: Floats = chdtri(degrees, false_closure)
    return result


def inliers(graph: PoseGraph, false_closure: float) -> Booleans:
    """(m,): which of the closures of `graph` hold, heading and all."""
    closures = graph.closures
    if not len(closures):
        return np.zeros(0, bool)
    limit = limits(closures, false_closure)
    hold = _by_weights(graph, limit)
    return _readmit(graph, hold, limit)


def _by_weights(graph: PoseGraph, limit: Floats) -> Booleans:
    weights = np.ones(len(limit))
    convexity = 0.0
    for _ in range(MOST_ROUNDS):
        poses = optimize(PoseGraph(graph.poses, graph.steps, graph.closures.weighted(weights)))
        excess = mahalanobis2(residuals(poses, graph.closures), graph.closures.information) / limit
        if not convexity:
            if excess.max() <= 1:
                break
            convexity = 1 / (2 * excess.max() - 1)
        weights = (np.sqrt(convexity * (convexity + 1) / excess.clip(1e-12)) - convexity).clip(
            LEAST_WEIGHT, 1.0
        )
        if ((weights == LEAST_WEIGHT) | (weights == 1.0)).all():
            break
        convexity *= STEEPER
    return weights > 0.5


def _readmit(graph: PoseGraph, hold: Booleans, limit: Floats) -> Booleans:
    """A closure that came to be left out may yet agree with those that hold, since the path is long
    between them.
    """
    solved = IncrementalSolver(PoseGraph(graph.poses, graph.steps, graph.closures.select(hold)))
    hold = hold.copy()
    for index in np.flatnonzero(~hold):
        closure = graph.closures.select(np.array([index]))
        if solved.chi_square(closure) <= limit[index]:
            solved.add(closure)
            hold[index] = True
    return hold
