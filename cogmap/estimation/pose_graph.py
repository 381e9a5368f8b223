"""Pose graphs: the poses of a path, and constraints between them by path integration and by closed
loops (paper eq. 5-7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices, wrap_angle


@dataclass(frozen=True)
class Constraints:
    """m constraints; number k measures pose `j[k]` in the frame of pose `i[k]`.

    `measurement` (m, 3) is dx_m, dy_m, dheading_rad; `information` (m, 3, 3) is the inverse of its
    covariance, and singular if the heading is not measured.
    """

    i: Indices
    j: Indices
    measurement: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.i)

    @property
    def variance_m2(self) -> Floats:
        """Return the variance of the positions, (m,), if it is the same by either axis."""
        variance_m2: Floats = 1 / self.information[:, 0, 0]
        return variance_m2

    @property
    def variance_rad2(self) -> Floats:
        """Return the variance of the headings, (m,), if they are measured by themselves."""
        variance_rad2: Floats = 1 / self.information[:, 2, 2]
        return variance_rad2

    def select(self, chosen: Booleans | Indices | slice) -> Constraints:
        """Return the chosen constraints, by mask, indices or slice."""
        return Constraints(
            i=self.i[chosen],
            j=self.j[chosen],
            measurement=self.measurement[chosen],
            information=self.information[chosen],
        )

    def weighted(self, weights: Floats) -> Constraints:
        """Return the same constraints with their information multiplied by (m,) weights."""
        weighted = self.information * weights[:, None, None]
        return replace(self, information=weighted)

    def __add__(self, other: Constraints) -> Constraints:
        return Constraints(
            i=np.concatenate([self.i, other.i]),
            j=np.concatenate([self.j, other.j]),
            measurement=np.concatenate([self.measurement, other.measurement]),
            information=np.concatenate([self.information, other.information]),
        )


NO_CONSTRAINTS = Constraints(
    i=np.zeros(0, np.int64),
    j=np.zeros(0, np.int64),
    measurement=np.zeros((0, 3)),
    information=np.zeros((0, 3, 3)),
)


@dataclass(frozen=True)
class PoseGraph:
    """`poses` (n, 3) along a path, `steps` from each pose to the next, and between any two
    `closures`, which may be mistaken, and `joins`, which are not.
    """

    poses: Floats
    steps: Constraints
    closures: Constraints
    joins: Constraints = NO_CONSTRAINTS

    @classmethod
    def of(cls, poses: Floats, constraints: Constraints) -> PoseGraph:
        """Sort constraints into steps and closures. The first constraint from a pose to the next is
        the step.

        Raises MessageError if a pose has no step to the next.
        """
        successive = np.flatnonzero(constraints.j == constraints.i + 1)
        _, first = np.unique(constraints.i[successive], return_index=True)
        steps = successive[first]
        if len(steps) != len(poses) - 1:
            pose = int(np.setdiff1d(np.arange(len(poses) - 1), constraints.i[steps])[0])
            raise MessageError(
                f"no constraint leads from pose {pose} to the next: a path needs every step"
            )

        numbers = np.arange(len(constraints))
        closures = np.setdiff1d(numbers, steps)
        return cls(
            poses=poses,
            steps=constraints.select(steps),
            closures=constraints.select(closures),
        )

    def with_closures(self, closures: Constraints) -> PoseGraph:
        """Return the same path with other closures."""
        return replace(self, closures=closures)

    @property
    def constraints(self) -> Constraints:
        """Return all constraints, the steps first."""
        return self.steps + self.joins + self.closures


def diagonal_information(position: Floats, heading: Floats) -> Floats:
    """Return the information (m, 3, 3) of positions, (m,) by either axis, and of headings, (m,)."""
    information = np.zeros((len(position), 3, 3))
    information[:, 0, 0] = position
    information[:, 1, 1] = position
    information[:, 2, 2] = heading
    return information


def adjacency(one: Indices, other: Indices, count: int) -> sparse.csc_matrix:
    """Count by how many of (m,) pairs two numbers are joined, both directions: (count, count)."""
    rows = np.concatenate([one, other])
    columns = np.concatenate([other, one])

    ones = np.ones(len(rows))
    return sparse.csc_matrix((ones, (rows, columns)), shape=(count, count))


def residuals(poses: Floats, constraints: Constraints) -> Floats:
    """Compute what the poses make of each constraint less what it measures, (m, 3), in the frame of
    pose i.
    """
    origins = poses[constraints.i]
    ends = poses[constraints.j]

    residual = relative(origins, ends) - constraints.measurement
    residual[:, 2] = wrap_angle(residual[:, 2])
    return residual


def matvec(matrices: Floats, vectors: Floats) -> Floats:
    """Multiply each of (m, a, b) matrices by its vector of (m, b): (m, a)."""
    product: Floats = np.einsum("mab,mb->ma", matrices, vectors)
    return product


def mahalanobis2(residual: Floats, information: Floats) -> Floats:
    """Compute the terms d' S^-1 d of eq. 7, (m,), for (m, 3) residuals."""
    squared: Floats = np.einsum("ma,mab,mb->m", residual, information, residual)
    return squared


def cost(poses: Floats, constraints: Constraints) -> float:
    """Compute eq. 7, headings included."""
    residual = residuals(poses, constraints)
    terms = mahalanobis2(residual, constraints.information)
    return float(terms.sum())


def jacobians(poses: Floats, constraints: Constraints) -> tuple[Floats, Floats]:
    """Compute the derivative of each residual by pose i, and by pose j, (m, 3, 3) each."""
    origins = poses[constraints.i]
    ends = poses[constraints.j]
    predicted = relative(origins, ends)

    by_j = np.zeros((len(constraints), 3, 3))
    by_j[:, :2, :2] = rotation_matrices(-origins[:, 2])
    by_j[:, 2, 2] = 1.0

    by_i = -by_j
    by_i[:, 0, 2] = predicted[:, 1]
    by_i[:, 1, 2] = -predicted[:, 0]
    return by_i, by_j


def sqrt_information(information: Floats) -> Floats:
    """Return (m, 3, 3) matrices R with R R' = `information`, which may be singular."""
    values, vectors = np.linalg.eigh(information)
    scales = np.sqrt(values.clip(0.0))

    root: Floats = vectors * scales[:, None, :]
    return root
