"""Inliers among loop closures, by graduated non-convexity: a place taken for another must not bend
the map (beyond the paper).

Yang et al. 2020 (doi 10.1109/LRA.2020.2965893) on truncated least squares: at first every closure
has its full weight, and the weight of those that fit badly falls round by round, until each closure
is an inlier or an outlier.

Closures that state the same pull as one. What the weights lead to is then settled by hypotheses.
"""

from __future__ import annotations

import numpy as np

from cogmap.estimation.hypotheses import Hypotheses
from cogmap.estimation.least_squares import NormalEquations, optimize
from cogmap.estimation.pose_graph import PoseGraph, mahalanobis2, residuals
from cogmap.geometry.arrays import Booleans

# Yang et al.'s.
CONVEXITY_FACTOR = 1.4
# A bound: convexity grows 10^8-fold in so many rounds. Closures of the least weight are outliers.
MAX_ROUNDS = 60
MIN_WEIGHT = 1e-6
# A round need not converge: the next one has other weights.
ITERATIONS_PER_ROUND = 20
# If weights leave fewer, most closures contradict one another, and which fell first means little.
RELIABLE_SHARE = 0.5


def inliers(graph: PoseGraph, false_closure: float) -> Booleans:
    """Mark the closures of `graph` that are inliers, (m,), headings included."""
    if not len(graph.closures):
        return np.zeros(0, bool)

    hypotheses = Hypotheses(graph, false_closure)
    weighty = _by_weights(graph, hypotheses)
    settled = hypotheses.settled(weighty)
    if weighty.mean() >= RELIABLE_SHARE or not weighty.any():
        return settled

    nothing = np.zeros_like(weighty)
    by_path_alone = hypotheses.settled(nothing)
    anew = hypotheses.settled(by_path_alone)
    return min(settled, anew, key=hypotheses.truncated_cost)


def _by_weights(graph: PoseGraph, hypotheses: Hypotheses) -> Booleans:
    """Mark the closures that keep their weight, (m,)."""
    normal = NormalEquations(len(graph.poses), graph.constraints)
    weights = np.ones(len(graph.closures))
    convexity = 0.0

    for _ in range(MAX_ROUNDS):
        # Each closure's misfit of the path that so weighted ones lead to, over its threshold.
        closures = graph.closures
        weighted = graph.with_closures(closures.weighted(weights * hypotheses.shares))
        poses = optimize(weighted, ITERATIONS_PER_ROUND, normal)
        residual = residuals(poses, closures)
        excess = mahalanobis2(residual, closures.information) / hypotheses.threshold
        if not convexity:
            worst = excess.max()
            if worst <= 1:
                break
            convexity = 1 / (2 * worst - 1)

        # The weights of the surrogate of truncated least squares.
        squared = convexity * (convexity + 1) / excess.clip(1e-12)
        weights = (np.sqrt(squared) - convexity).clip(MIN_WEIGHT, 1.0)
        is_decided = (weights == MIN_WEIGHT) | (weights == 1.0)
        if is_decided.all():
            break
        convexity *= CONVEXITY_FACTOR

    return weights > 0.5
