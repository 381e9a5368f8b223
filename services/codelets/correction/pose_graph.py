"""Pose graphs: the poses of a path, and constraints between them by path integration and by closed
loops (paper eq. 5-7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices, wrap_angle


@dataclass(frozen=True)
class Constraints:
    """m constraints; number k measures pose `j[k]` in the frame of pose `i[k]`.

    `measurement` (m, 3) is dx_m, dy_m, dheading_rad; `information` (m, 3, 3) is the inverse of its
    covariance, and singular where the heading is not measured.
    """

    i: Indices
    j: Indices
    measurement: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.i)

    def select(self, chosen: Booleans | Indices | slice) -> Constraints:
        """The chosen ones, by mask, indices or slice."""
        return Constraints(
            self.i[chosen],
            self.j[chosen],
            self.measurement[chosen],
            self.information[chosen],
        )

    def weighted(self, weights: Floats) -> Constraints:
        """The same with their information multiplied by (m,) weights."""
        information = self.information * weights[:, None, None]
        return Constraints(self.i, self.j, self.measurement, information)

    def __add__(self, other: Constraints) -> Constraints:
        return Constraints(
            np.concatenate([self.i, other.i]),
            np.concatenate([self.j, other.j]),
            np.concatenate([self.measurement, other.measurement]),
            np.concatenate([self.information, other.information]),
        )


@dataclass(frozen=True)
class PoseGraph:
    """`poses` (n, 3) along a path, `steps` from each pose to the next, and `closures` between any
    two.
    """

    poses: Floats
    steps: Constraints
    closures: Constraints

    @classmethod
    def of(cls, poses: Floats, constraints: Constraints) -> PoseGraph:
        """Sort constraints into steps and closures. The first constraint from a pose to the next is
        the step.

        Raises MessageError where a pose has no step to the next.
        """
        successive = np.flatnonzero(constraints.j == constraints.i + 1)
        _, first = np.unique(constraints.i[successive], return_index=True)
        steps = successive[first]

        if len(steps) != len(poses) - 1:
            missing = np.setdiff1d(np.arange(len(poses) - 1), constraints.i[steps])
            raise MessageError(
                f"no constraint leads from pose {missing[0]} to the next: a path needs every step"
            )

        closures = np.setdiff1d(np.arange(len(constraints)), steps)
        return cls(poses, constraints.select(steps), constraints.select(closures))

    @property
    def constraints(self) -> Constraints:
        """All constraints, the steps first."""
        return self.steps + self.closures


def residuals(poses: Floats, constraints: Constraints) -> Floats:
    """(m, 3): what the poses make of each constraint less what it measures, in the frame of pose
    i.
    """
    predicted = relative(poses[constraints.i], poses[constraints.j])
    residual = predicted - constraints.measurement
    residual[:, 2] = wrap_angle(residual[:, 2])
    return residual


def mahalanobis2(residual: Floats, information: Floats) -> Floats:
    """(m,): the terms d' S^-1 d of eq. 7, for (m, 3) residuals."""
    squared: Floats = np.einsum("ma,mab,mb->m", residual, information, residual)
    return squared


def cost(poses: Floats, constraints: Constraints) -> float:
    """Eq. 7, headings included."""
    terms = mahalanobis2(residuals(poses, constraints), constraints.information)
    return float(terms.sum())


def jacobians(poses: Floats, constraints: Constraints) -> tuple[Floats, Floats]:
    """(m, 3, 3) each: the derivative of each residual by pose i, and by pose j."""
    predicted = relative(poses[constraints.i], poses[constraints.j])

    by_j = np.zeros((len(constraints), 3, 3))
    by_j[:, :2, :2] = rotation_matrices(-poses[constraints.i, 2])
    by_j[:, 2, 2] = 1.0

    by_i = -by_j
    by_i[:, 0, 2] = predicted[:, 1]
    by_i[:, 1, 2] = -predicted[:, 0]
    return by_i, by_j


def sqrt_information(information: Floats) -> Floats:
    """(m, 3, 3) matrices R with R R' = `information`, which may be singular."""
    values, vectors = np.linalg.eigh(information)
    root: Floats = vectors * np.sqrt(values.clip(0.0))[:, None, :]
    return root
