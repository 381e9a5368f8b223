"""The peers of map correction: exact least squares for positions, gtsam for poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from benchmarks import optional
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.estimation.reverse_replay import displacements
from cogmap.geometry.arrays import Floats


def best_positions(graph: PoseGraph) -> Floats:
    """Return (n, 2) positions that minimise eq. 7 exactly; headings and the first position stay."""
    known = displacements(graph.poses, graph.constraints)

    # (2m, 2(n - 1)): takes all positions but the first to the m differences between two each.
    number = len(graph.constraints)
    rows = np.tile(np.arange(number), 2)
    columns = np.concatenate([graph.constraints.j, graph.constraints.i])
    signs = np.repeat([1.0, -1.0], number)
    of_one_axis = sparse.csr_matrix((signs, (rows, columns)), shape=(number, len(graph.poses)))
    differences = sparse.kron(of_one_axis[:, 1:], sparse.identity(2), format="csc")

    covariance = sparse.block_diag(known.covariance_m2, format="csc")

    # Forces and positions together: the normal equations lose what a certain constraint leaves to
    # uncertain ones.
    blocks = [[covariance, differences], [differences.T, None]]
    left_side = sparse.bmat(blocks, format="csc")
    _, unknowns = differences.shape
    offsets_m = known.offset_m.reshape(-1)
    right_side = np.concatenate([offsets_m, np.zeros(unknowns)])
    found = spsolve(left_side, right_side)

    others_m = found[-unknowns:].reshape(-1, 2)
    from_first_m = np.vstack([np.zeros(2), others_m])
    positions_m: Floats = graph.poses[0, :2] + from_first_m
    return positions_m


class Gtsam:
    """The same graph for gtsam. Raises UsageError if gtsam is not installed."""

    def __init__(self, poses: Floats, constraints: Constraints) -> None:
        self._gtsam = optional.gtsam()
        self._count = len(poses)
        self._start = self._gtsam.Values()
        self._graph = self._gtsam.NonlinearFactorGraph()
        self._parameters = self._gtsam.LevenbergMarquardtParams()

        for number, pose in enumerate(poses):
            guess = self._gtsam.Pose2(*pose)
            self._start.insert(number, guess)

        first = self._gtsam.Pose2(*poses[0])
        fixed = self._gtsam.noiseModel.Constrained.All(3)
        prior = self._gtsam.PriorFactorPose2(0, first, fixed)
        self._graph.add(prior)

        for i, j, measurement, information in zip(
            constraints.i.tolist(),
            constraints.j.tolist(),
            constraints.measurement,
            constraints.information,
            strict=True,
        ):
            noise = self._gtsam.noiseModel.Gaussian.Information(information)
            between = self._gtsam.Pose2(*measurement)
            self._graph.add(self._gtsam.BetweenFactorPose2(i, j, between, noise))

    def solve(self) -> Any:
        """Solve by Levenberg and Marquardt's method, with gtsam's defaults, for `poses` to read."""
        optimizer = self._gtsam.LevenbergMarquardtOptimizer(
            self._graph, self._start, self._parameters
        )
        return optimizer.optimize()

    def gives_up(self) -> bool:
        """Decide whether gtsam's default, factoring by Cholesky, leaves all as it was.

        If so, `solve` factors by QR from then on.
        """
        error = self._graph.error(self.solve())
        gives_up = bool(error >= self._graph.error(self._start))

        if gives_up:
            self._parameters.setLinearSolverType("MULTIFRONTAL_QR")

        return gives_up

    def poses(self, values: Any) -> Floats:
        """Return (n, 3) poses of a result of `solve`."""
        return optional.gtsam_poses(values, range(self._count))
