"""Pose graphs optimized with their headings, beyond the paper: sparse nonlinear least squares by
Levenberg-Marquardt.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from cogmap.geometry.arrays import Booleans, Floats, Indices
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    cost,
    jacobians,
    residuals,
)

RELATIVE_DECREASE = 1e-5
MAX_ITERATIONS = 100
MIN_DAMPING = 1e-9
MAX_DAMPING = 1e8
DAMPING_FACTOR = 10.0
# Symmetric, positive definite and ordered beforehand: no pivoting. The three columns of a pose
# belong together.
FACTORING = {
    "permc_spec": "NATURAL",
    "diag_pivot_thresh": 0.0,
    "relax": 3,
    "panel_size": 1,
    "options": {"SymmetricMode": True},
}


class NormalEquations:
    """The normal equations of constraints among `count` poses, whose sparsity is analysed once.

    The first pose is fixed. The unknowns, three a pose, are ordered for sparse factors.
    """

    def __init__(self, count: int, constraints: Constraints) -> None:
        self._order = _elimination_order(count, constraints)
        self._position = np.full(count, -1)
        self._position[self._order] = np.arange(count - 1)
        self._side = 3 * (count - 1)

        i = self._position[constraints.i]
        j = self._position[constraints.j]
        self._analyse_blocks(i, j, count - 1)

        ends = np.concatenate([i, j])
        used = np.flatnonzero(ends >= 0)
        self._sum_ends = _summing(ends[used], used, count - 1, len(ends))

    def _analyse_blocks(self, i: Indices, j: Indices, unknown_poses: int) -> None:
        """Where the four 3 x 3 blocks of each constraint go: by i and i, i and j, j and i, j and
        j.
        """
        rows = np.concatenate([i, i, j, j])
        columns = np.concatenate([i, j, i, j])
        used = np.flatnonzero((rows >= 0) & (columns >= 0))

        keys = columns[used] * unknown_poses + rows[used]
        blocks, target = np.unique(keys, return_inverse=True)
        self._sum_blocks = _summing(target, used, len(blocks), len(rows))

        column_keys = np.arange(unknown_poses + 1) * unknown_poses
        self._indices = (blocks % unknown_poses).astype(np.int32)
        self._starts = np.searchsorted(blocks, column_keys).astype(np.int32)

    def matrix(self, poses: Floats, constraints: Constraints) -> sparse.csc_matrix:
        """J' S^-1 J at `poses`."""
        by_i, by_j = jacobians(poses, constraints)
        weighted_i = by_i.transpose(0, 2, 1) @ constraints.information
        weighted_j = by_j.transpose(0, 2, 1) @ constraints.information
        across = weighted_i @ by_j

        # Columns are stored, and blocks by rows: each is transposed.
        parts = [weighted_i @ by_i, across.transpose(0, 2, 1), across, weighted_j @ by_j]
        blocks = np.concatenate(parts).reshape(-1, 9)
        data = (self._sum_blocks @ blocks).reshape(-1, 3, 3)

        shape = (self._side, self._side)
        rows = sparse.bsr_matrix((data, self._indices, self._starts), shape=shape).tocsr()
        return sparse.csc_matrix((rows.data, rows.indices, rows.indptr), shape=shape)

    def gradient(self, poses: Floats, constraints: Constraints) -> Floats:
        """J' S^-1 d at `poses`, (3 (n - 1),)."""
        residual = residuals(poses, constraints)
        weighted = np.einsum("mab,mb->ma", constraints.information, residual)

        by_i, by_j = jacobians(poses, constraints)
        at_i = np.einsum("mba,mb->ma", by_i, weighted)
        at_j = np.einsum("mba,mb->ma", by_j, weighted)

        gradient: Floats = (self._sum_ends @ np.concatenate([at_i, at_j])).reshape(-1)
        return gradient

    def unknowns(self, pose: Indices) -> tuple[Indices, Booleans]:
        """(k, 3): the unknowns of k poses, and (k,) which poses have any: the first has none."""
        position = self._position[pose]
        return 3 * position[:, None] + np.arange(3), position >= 0

    def moved(self, poses: Floats, step: Floats) -> Floats:
        """`poses` after a step of the unknowns."""
        result = poses.copy()
        result[self._order] += step.reshape(-1, 3)
        return result


def _elimination_order(count: int, constraints: Constraints) -> Indices:
    """The poses but the first, in an order of little fill (minimum degree)."""
    rows = np.concatenate([constraints.i, constraints.j])
    columns = np.concatenate([constraints.j, constraints.i])
    adjacency = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    pattern = adjacency[1:, 1:]
    pattern.data[:] = 1.0

    # A dominant diagonal, so that the order is decided by the pattern alone.
    dominant = (pattern + count * sparse.identity(count - 1)).tocsc()
    factors = splu(dominant, **(FACTORING | {"permc_spec": "MMD_AT_PLUS_A"}))
    order: Indices = np.argsort(factors.perm_c) + 1
    return order


def _summing(target: Indices, source: Indices, targets: int, sources: int) -> sparse.csr_matrix:
    """A matrix that adds row `source[k]` of what it is multiplied with to row `target[k]`."""
    return sparse.csr_matrix((np.ones(len(target)), (target, source)), shape=(targets, sources))


def factor(matrix: sparse.csc_matrix) -> SuperLU:
    """The factors of a positive definite matrix, in its own order."""
    return splu(matrix, **FACTORING)


def optimize(graph: PoseGraph, max_iterations: int = MAX_ITERATIONS) -> Floats:
    """(n, 3): poses at a minimum of eq. 7, headings included, near those of `graph`. The first pose
    stays.

    After `max_iterations`, the best so far.
    """
    poses = graph.poses
    constraints = graph.constraints
    normal = NormalEquations(len(poses), constraints)
    damping = 0.0
    before = cost(poses, constraints)

    for _ in range(max_iterations):
        gradient = normal.gradient(poses, constraints)
        matrix = _damped(normal.matrix(poses, constraints), damping)
        step = factor(matrix).solve(gradient)
        moved = normal.moved(poses, -step)
        after = cost(moved, constraints)

        if after > before:
            damping = max(MIN_DAMPING, damping * DAMPING_FACTOR)
            if damping > MAX_DAMPING:
                break
            continue

        predicted = before - float(gradient @ step)
        decrease = before - after
        poses = moved
        before = after

        # What the linear model did not predict is about what another step would gain.
        is_linear = not damping and after - predicted <= RELATIVE_DECREASE * after
        if decrease <= RELATIVE_DECREASE * after or is_linear:
            break
        damping = damping / DAMPING_FACTOR if damping > MIN_DAMPING else 0.0
    return poses


def _damped(matrix: sparse.csc_matrix, damping: float) -> sparse.csc_matrix:
    if not damping:
        return matrix
    return matrix + damping * sparse.diags(matrix.diagonal(), format="csc")
