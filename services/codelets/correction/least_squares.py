"""Loops closed with headings corrected too, beyond the paper: Gauss-Newton on the whole path,
sparse.
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
MOST_ITERATIONS = 100
LEAST_DAMPING = 1e-9
MOST_DAMPING = 1e8
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
    """The normal equations of constraints among `count` poses, whose sparsity is worked out once.

    The first pose stays. Unknowns stand in an order that makes the factors sparse.
    """

    def __init__(self, count: int, constraints: Constraints) -> None:
        self._order = _elimination_order(count, constraints)
        self._at = np.full(count, -1)
        self._at[self._order] = np.arange(count - 1)
        first = self._at[constraints.i]
        second = self._at[constraints.j]
        rows = np.concatenate([first, first, second, second])
        columns = np.concatenate([first, second, first, second])
        used = np.flatnonzero((rows >= 0) & (columns >= 0))
        blocks, target = np.unique(columns[used] * (count - 1) + rows[used], return_inverse=True)
        self._sum_blocks = _summing(target, used, len(blocks), len(rows))
        self._indices = (blocks % (count - 1)).astype(np.int32)
        self._starts = np.searchsorted(blocks, np.arange(count) * (count - 1)).astype(np.int32)
        ends = np.concatenate([first, second])
        used = np.flatnonzero(ends >= 0)
        self._sum_ends = _summing(ends[used], used, count - 1, len(ends))
        self._side = 3 * (count - 1)

    def matrix(self, poses: Floats, constraints: Constraints) -> sparse.csc_matrix:
        """J' S^-1 J at `poses`."""
        by_first, by_second = jacobians(poses, constraints)
        weighed_first = by_first.transpose(0, 2, 1) @ constraints.information
        weighed_second = by_second.transpose(0, 2, 1) @ constraints.information
        across = weighed_first @ by_second
        # Columns are stored, and blocks by rows: each is transposed.
        blocks = np.concatenate(
            [
                weighed_first @ by_first,
                across.transpose(0, 2, 1),
                across,
                weighed_second @ by_second,
            ]
        )
        data = (self._sum_blocks @ blocks.reshape(-1, 9)).reshape(-1, 3, 3)
        shape = (self._side, self._side)
        rows = sparse.bsr_matrix((data, self._indices, self._starts), shape=shape).tocsr()
        return sparse.csc_matrix((rows.data, rows.indices, rows.indptr), shape=shape)

    def gradient(self, poses: Floats, constraints: Constraints) -> Floats:
        """J' S^-1 d at `poses`."""
        by_first, by_second = jacobians(poses, constraints)
        weighed = np.einsum("mab,mb->ma", constraints.information, residuals(poses, constraints))
        ends = [np.einsum("mba,mb->ma", by_end, weighed) for by_end in (by_first, by_second)]
        result: Floats = (self._sum_ends @ np.concatenate(ends)).reshape(-1)
        return result

    def unknowns(self, pose: Indices) -> tuple[Indices, Booleans]:
        """(k, 3) which unknowns some poses are, and which of the poses are any: the first is none."""
        known = self._at[pose] >= 0
        return 3 * self._at[pose][:, None] + np.arange(3), known

    def moved(self, poses: Floats, step: Floats) -> Floats:
        """`poses` after a step of the unknowns."""
        result = poses.copy()
        result[self._order] += step.reshape(-1, 3)
        return result


def _elimination_order(count: int, constraints: Constraints) -> Indices:
    """The poses but the first, in an order of little fill (minimum degree)."""
    ends = (
        np.concatenate([constraints.i, constraints.j]),
        np.concatenate([constraints.j, constraints.i]),
    )
    touching = sparse.csc_matrix((np.ones(len(ends[0])), ends), shape=(count, count))[1:, 1:]
    touching.data[:] = 1.0
    # Dominant diagonal, so that the order is decided by the pattern alone.
    dominant = (touching + count * sparse.identity(count - 1)).tocsc()
    order: Indices = (
        np.argsort(splu(dominant, **(FACTORING | {"permc_spec": "MMD_AT_PLUS_A"})).perm_c) + 1
    )
    return order


def _summing(target: Indices, source: Indices, targets: int, sources: int) -> sparse.csr_matrix:
    """A matrix that adds row `source[k]` of what it is multiplied with to row `target[k]`."""
    return sparse.csr_matrix((np.ones(len(target)), (target, source)), shape=(targets, sources))


def factor(matrix: sparse.csc_matrix) -> SuperLU:
    """Factors of a positive definite matrix, its order as it is."""
    return splu(matrix, **FACTORING)


def optimize(graph: PoseGraph, most_iterations: int = MOST_ITERATIONS) -> Floats:
    """(n, 3) poses that minimise eq. 7, headings and all, near those of `graph`. The first pose
    stays.

    Where `most_iterations` do not do, they are nearer to the least than those of `graph`.
    """
    poses = graph.poses
    constraints = graph.constraints
    normal = NormalEquations(len(poses), constraints)
    damping = 0.0
    before = cost(poses, constraints)
    for _ in range(most_iterations):
        matrix = normal.matrix(poses, constraints)
        gradient = normal.gradient(poses, constraints)
        damped = (
            matrix + damping * sparse.diags(matrix.diagonal(), format="csc") if damping else matrix
        )
        step = factor(damped).solve(gradient)
        moved = normal.moved(poses, -step)
        after = cost(moved, constraints)
        if after > before:
            damping = max(LEAST_DAMPING, damping * DAMPING_FACTOR)
            if damping > MOST_DAMPING:
                break
            continue
        # What the linear model did not foresee is about what another step would gain.
        unforeseen = after - (before - float(gradient @ step))
        gained = before - after
        poses = moved
        before = after
        if gained <= RELATIVE_DECREASE * after or (
            not damping and unforeseen <= RELATIVE_DECREASE * after
        ):
            break
        damping = damping / DAMPING_FACTOR if damping > LEAST_DAMPING else 0.0
    return poses
