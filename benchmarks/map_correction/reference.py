"""What map correction is held against: exact least squares for positions, gtsam for poses."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from services.codelets.correction.pose_graph import Constraints, PoseGraph
from services.codelets.correction.reverse_replay import displacements

gtsam: Any
try:
    gtsam = importlib.import_module("gtsam")
except ImportError:
    gtsam = None


def best_positions(graph: PoseGraph) -> Floats:
    """(n, 2) positions that minimise eq. 7 exactly, the headings and the first position as they
    are.
    """
    constraints = graph.constraints
    count = len(graph.poses)
    known = displacements(graph.poses, constraints)
    edges = np.arange(len(constraints))
    signs = np.repeat([1.0, -1.0], len(constraints))
    ends = np.concatenate([constraints.j, constraints.i])
    across = sparse.csr_matrix((signs, (np.tile(edges, 2), ends)), shape=(len(constraints), count))
    differences = sparse.kron(across[:, 1:], sparse.identity(2), format="csc")
    covariance = sparse.block_diag(known.covariance_m2, format="csc")
    # Forces and positions together: the normal equations lose what a certain constraint leaves to
    # uncertain ones.
    both = sparse.bmat([[covariance, differences], [differences.T, None]], format="csc")
    found = spsolve(both, np.concatenate([known.off_m.reshape(-1), np.zeros(differences.shape[1])]))
    positions = found[differences.shape[0] :].reshape(-1, 2)
    result: Floats = graph.poses[0, :2] + np.vstack([np.zeros(2), positions])
    return result


class Gtsam:
    """The same graph for gtsam. Raises UsageError where gtsam is not installed."""

    def __init__(self, poses: Floats, constraints: Constraints) -> None:
        if gtsam is None:
            raise UsageError(
                "gtsam is not installed, and this benchmark measures against it: run make bench-setup"
            )
        self._count = len(poses)
        self._start, self._graph = gtsam.Values(), gtsam.NonlinearFactorGraph()
        self._parameters = gtsam.LevenbergMarquardtParams()
        for index, pose in enumerate(poses):
            self._start.insert(index, gtsam.Pose2(*pose))
        fixed = gtsam.noiseModel.Constrained.All(3)
        self._graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*poses[0]), fixed))
        columns = (constraints.i.tolist(), constraints.j.tolist(), constraints.measurement)
        for first, second, measured, information in zip(
            *columns, constraints.information, strict=True
        ):
            noise = gtsam.noiseModel.Gaussian.Information(information)
            self._graph.add(gtsam.BetweenFactorPose2(first, second, gtsam.Pose2(*measured), noise))

    def solve(self) -> Any:
        """Levenberg and Marquardt's method, as gtsam has it by default; `poses` reads the result."""
        return gtsam.LevenbergMarquardtOptimizer(
            self._graph, self._start, self._parameters
        ).optimize()

    def gives_up(self) -> bool:
        """Whether gtsam's default, factoring by Cholesky, leaves all as it was; `solve` factors by
        QR from then on.
        """
        gives_up = bool(self._graph.error(self.solve()) >= self._graph.error(self._start))
        if gives_up:
            self._parameters.setLinearSolverType("MULTIFRONTAL_QR")
        return gives_up

    def poses(self, values: Any) -> Floats:
        """(n, 3)."""
        found = [values.atPose2(index) for index in range(self._count)]
        return np.array([(pose.x(), pose.y(), pose.theta()) for pose in found])
