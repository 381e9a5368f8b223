"""What map correction is held against: exact least squares for positions, gtsam for poses."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from bus.errors import UsageError
from services.codelets.pose_graph import Constraints, Floats, PoseGraph
from services.codelets.replay import displacements

gtsam: Any
try:
    gtsam = importlib.import_module("gtsam")
except ImportError:
    gtsam = None


def best_positions(graph: PoseGraph) -> Floats:
    """(n, 2) positions that minimise eq. 7 exactly, the headings and the first position as they are."""
    constraints, count = graph.constraints, len(graph.poses)
    known = displacements(graph.poses, constraints)
    edges = np.arange(len(constraints))
    signs = np.repeat([1.0, -1.0], len(constraints))
    ends = np.concatenate([constraints.second, constraints.first])
    across = sparse.csr_matrix((signs, (np.tile(edges, 2), ends)), shape=(len(constraints), count))
    differences = sparse.kron(across[:, 1:], sparse.identity(2), format="csr")
    weights = sparse.block_diag(np.linalg.inv(known.covariance_m2), format="csr")
    normal = (differences.T @ weights @ differences).tocsc()
    offset = known.off_m.reshape(-1)
    found = spsolve(normal, differences.T @ (weights @ offset), permc_spec="MMD_AT_PLUS_A")
    result: Floats = graph.poses[0, :2] + np.vstack([np.zeros(2), found.reshape(-1, 2)])
    return result


class Gtsam:
    """The same graph for gtsam. Raises UsageError where gtsam is not installed."""

    def __init__(self, poses: Floats, constraints: Constraints) -> None:
        if gtsam is None:
            raise UsageError("gtsam is not installed, and this benchmark measures against it: run make bench-setup")
        self._count = len(poses)
        self._start, self._graph = gtsam.Values(), gtsam.NonlinearFactorGraph()
        for index, pose in enumerate(poses):
            self._start.insert(index, gtsam.Pose2(*pose))
        fixed = gtsam.noiseModel.Constrained.All(3)
        self._graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*poses[0]), fixed))
        columns = (constraints.first.tolist(), constraints.second.tolist(), constraints.measured)
        for first, second, measured, information in zip(*columns, constraints.information, strict=True):
            noise = gtsam.noiseModel.Gaussian.Information(information)
            self._graph.add(gtsam.BetweenFactorPose2(first, second, gtsam.Pose2(*measured), noise))

    def solve(self) -> Any:
        """Levenberg and Marquardt's method, as gtsam has it by default; `poses` reads the result."""
        return gtsam.LevenbergMarquardtOptimizer(self._graph, self._start).optimize()

    def poses(self, values: Any) -> Floats:
        """(n, 3)."""
        found = [values.atPose2(index) for index in range(self._count)]
        return np.array([(pose.x(), pose.y(), pose.theta()) for pose in found])
