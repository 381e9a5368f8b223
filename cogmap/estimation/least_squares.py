"""Pose graphs optimized with their headings, beyond the paper: sparse nonlinear least squares by
Levenberg-Marquardt.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from cogmap.estimation.pose_graph import (
    Constraints,
    PoseGraph,
    adjacency,
    cost,
    jacobians,
    matvec,
    residuals,
)
from cogmap.geometry.arrays import Booleans, Floats, Indices

# A step that gains a smaller share of the cost is the last; the iterations are a bound.
RELATIVE_DECREASE = 1e-5
MAX_ITERATIONS = 100
# Share of the diagonal that is added after a step that raised the cost, first and at most, and by
# how much it grows and shrinks from step to step.
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
        unknown_poses = count - 1
        self.unknown_count = 3 * unknown_poses
        self._order = elimination_order(count, constraints.i, constraints.j)
        self._position = np.full(count, -1)
        self._position[self._order] = np.arange(unknown_poses)

        i = self._position[constraints.i]
        j = self._position[constraints.j]
        self._pattern = _BlockPattern(i, j, unknown_poses)

        ends = np.concatenate([i, j])
        used = np.flatnonzero(ends >= 0)
        self._sum_ends = _summing(ends[used], used, unknown_poses, len(ends))

    def matrix(self, poses: Floats, constraints: Constraints) -> sparse.csc_matrix:
        """Compute J' S^-1 J at `poses`."""
        by_i, by_j = jacobians(poses, constraints)
        weighted_i = by_i.mT @ constraints.information
        weighted_j = by_j.mT @ constraints.information

        # The blocks of each constraint, each transposed, as a _BlockPattern sums them up.
        at_i = weighted_i @ by_i
        at_j = weighted_j @ by_j
        across = weighted_i @ by_j
        return self._pattern.summed(np.concatenate([at_i, across.mT, across, at_j]))

    def gradient(self, poses: Floats, constraints: Constraints) -> Floats:
        """Compute J' S^-1 d at `poses`, (3 (n - 1),)."""
        residual = residuals(poses, constraints)
        weighted = matvec(constraints.information, residual)

        by_i, by_j = jacobians(poses, constraints)
        at_i = np.einsum("mba,mb->ma", by_i, weighted)
        at_j = np.einsum("mba,mb->ma", by_j, weighted)

        at_ends = np.concatenate([at_i, at_j])

        by_pose = self._sum_ends @ at_ends
        gradient: Floats = by_pose.reshape(-1)
        return gradient

    def unknowns(self, pose: Indices) -> tuple[Indices, Booleans]:
        """Return the unknowns (k, 3) of k poses, and which have any, (k,): the first has none."""
        position = self._position[pose]
        is_free = position >= 0

        first = 3 * position[:, None]
        return first + np.arange(3), is_free

    def moved(self, poses: Floats, step: Floats) -> Floats:
        """Return `poses` after a step of the unknowns."""
        result = poses.copy()
        result[self._order] += step.reshape(-1, 3)
        return result


class _BlockPattern:
    """A sparse matrix that four 3 x 3 blocks of each constraint are summed up in: by the unknown
    poses i and i, i and j, j and i, j and j. A pose that is known is -1.
    """

    def __init__(self, i: Indices, j: Indices, unknown_poses: int) -> None:
        rows = np.concatenate([i, i, j, j])
        columns = np.concatenate([i, j, i, j])
        is_used = (rows >= 0) & (columns >= 0)
        used = np.flatnonzero(is_used)

        keys = columns[used] * unknown_poses + rows[used]
        blocks, target = np.unique(keys, return_inverse=True)

        self._sum = _summing(target, used, len(blocks), len(rows))

        # Blocks are stored by column, and by row within it, as their keys count them.
        first_keys = np.arange(unknown_poses + 1) * unknown_poses
        self._indices = (blocks % unknown_poses).astype(np.int32)
        self._starts = np.searchsorted(blocks, first_keys).astype(np.int32)
        self._shape = (3 * unknown_poses, 3 * unknown_poses)

    def summed(self, blocks: Floats) -> sparse.csc_matrix:
        """Sum (4 m, 3, 3) blocks into their matrix. Each is transposed: the matrix is stored by
        columns, and blocks by rows.
        """
        summed = self._sum @ blocks.reshape(-1, 9)
        data = summed.reshape(-1, 3, 3)

        stored = (data, self._indices, self._starts)
        transposed = sparse.bsr_matrix(stored, shape=self._shape).tocsr()

        columns = (transposed.data, transposed.indices, transposed.indptr)
        return sparse.csc_matrix(columns, shape=self._shape)


def elimination_order(count: int, one: Indices, other: Indices) -> Indices:
    """Order `count` poses, (m,) pairs of which are joined, but the first so that the factors have
    little fill (minimum degree).
    """
    joined = adjacency(one, other, count)
    pattern = joined[1:, 1:]
    pattern.data[:] = 1.0

    # A dominant diagonal, so that the order is decided by the pattern alone.
    diagonal = count * sparse.identity(count - 1)
    dominant = (pattern + diagonal).tocsc()

    by_degree = FACTORING | {"permc_spec": "MMD_AT_PLUS_A"}
    factors = splu(dominant, **by_degree)
    order: Indices = np.argsort(factors.perm_c) + 1
    return order


def _summing(target: Indices, source: Indices, targets: int, sources: int) -> sparse.csr_matrix:
    """Make a matrix that adds row `source[k]` of what it is multiplied with to row `target[k]`."""
    ones = np.ones(len(target))
    shape = (targets, sources)

    return sparse.csr_matrix((ones, (target, source)), shape=shape)


def factor(matrix: sparse.csc_matrix) -> SuperLU:
    """Compute the factors of a positive definite matrix, in its own order."""
    return splu(matrix, **FACTORING)


def optimize(
    graph: PoseGraph,
    max_iterations: int = MAX_ITERATIONS,
    normal: NormalEquations | None = None,
) -> Floats:
    """Find poses (n, 3) at a minimum of eq. 7, headings included, near those of `graph`. The first
    pose stays.

    After `max_iterations`, return the best so far. To analyse the sparsity is a quarter of the
    work: `normal` are the normal equations of constraints between the same poses.
    """
    poses = graph.poses
    constraints = graph.constraints
    if normal is None:
        normal = NormalEquations(len(poses), constraints)
    damping = 0.0
    before = cost(poses, constraints)

    for _ in range(max_iterations):
        gradient = normal.gradient(poses, constraints)
        matrix = normal.matrix(poses, constraints)
        if damping:
            matrix = matrix + damping * sparse.diags(matrix.diagonal(), format="csc")
        step = factor(matrix).solve(gradient)
        predicted_decrease = float(gradient @ step)

        moved = normal.moved(poses, -step)
        after = cost(moved, constraints)

        if after > before:
            damping = max(MIN_DAMPING, damping * DAMPING_FACTOR)
            if damping > MAX_DAMPING:
                break
            continue

        # What the linear model did not predict is about what another step would gain.
        unpredicted = after - (before - predicted_decrease)
        decrease = before - after
        poses = moved
        before = after

        least_decrease = RELATIVE_DECREASE * after
        is_linear = not damping and unpredicted <= least_decrease
        if decrease <= least_decrease or is_linear:
            break
        damping = damping / DAMPING_FACTOR if damping > MIN_DAMPING else 0.0

    return poses
