"""A path with what is known between its poses: path integration from each to the next, and loops
closed (eq. 5-7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices, wrap_angle


@dataclass(frozen=True)
class Constraints:
    """Constraint k says where pose `j[k]` is as seen from pose `i[k]`.

    `measurement` (m, 3) is dx_m, dy_m, dheading_rad; `information` (m, 3, 3) the inverse of its
    covariance, with zeros where nothing is known of the heading.
    """

    i: Indices
    j: Indices
    measurement: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.i)

    def select(self, chosen: Booleans | Indices | slice) -> Constraints:
        """Some of them."""
        return Constraints(
            self.i[chosen], self.j[chosen], self.measurement[chosen], self.information[chosen]
        )

    def weighted(self, weights: Floats) -> Constraints:
        """The same, each believed as much as its weight says."""
        return Constraints(
            self.i, self.j, self.measurement, self.information * weights[:, None, None]
        )

    def __add__(self, other: Constraints) -> Constraints:
        return Constraints(
            np.concatenate([self.i, other.i]),
            np.concatenate([self.j, other.j]),
            np.concatenate([self.measurement, other.measurement]),
            np.concatenate([self.information, other.information]),
        )


@dataclass(frozen=True)
class PoseGraph:
    """`poses` (n, 3) along a path, `steps` from pose k to k + 1 for every k, and `closures` between
    any two.
    """

    poses: Floats
    steps: Constraints
    closures: Constraints

    @classmethod
    def of(cls, poses: Floats, constraints: Constraints) -> PoseGraph:
        """Tell the steps of the path from the loops. Raises MessageError where a step is missing."""
        following = np.flatnonzero(constraints.j == constraints.i + 1)
        _, once = np.unique(constraints.i[following], return_index=True)
        steps = following[once]
        if len(steps) != len(poses) - 1:
            missing = np.setdiff1d(np.arange(len(poses) - 1), constraints.i[steps])
            raise MessageError(
                f"nothing is known from pose {missing[0]} to the next: a path has every step"
            )
        rest = np.setdiff1d(np.arange(len(constraints)), steps)
        return cls(poses, constraints.select(steps), constraints.select(rest))

    @property
    def constraints(self) -> Constraints:
        """All of them, the steps first."""
        return self.steps + self.closures


def residuals(poses: Floats, constraints: Constraints) -> Floats:
    """(m, 3): by how much `poses` disagree with each constraint, as seen from its first pose."""
    residual = relative(poses[constraints.i], poses[constraints.j]) - constraints.measurement
    residual[:, 2] = wrap_angle(residual[:, 2])
    return residual


def mahalanobis2(off: Floats, information: Floats) -> Floats:
    """(m,): the terms d' S^-1 d of eq. 7."""
    result: Floats = np.einsum("ma,mab,mb->m", off, information, off)
    return result


def cost(poses: Floats, constraints: Constraints) -> float:
    """Eq. 7, headings and all."""
    return float(mahalanobis2(residuals(poses, constraints), constraints.information).sum())


def jacobians(poses: Floats, constraints: Constraints) -> tuple[Floats, Floats]:
    """(m, 3, 3) each: how the discrepancy of each constraint changes with its first and with its
    second pose.
    """
    seen = relative(poses[constraints.i], poses[constraints.j])
    by_second = np.zeros((len(constraints), 3, 3))
    by_second[:, :2, :2] = rotation_matrices(-poses[constraints.i, 2])
    by_second[:, 2, 2] = 1.0
    by_first = -by_second
    by_first[:, 0, 2], by_first[:, 1, 2] = seen[:, 1], -seen[:, 0]
    return by_first, by_second


def sqrt_information(information: Floats) -> Floats:
    """(m, 3, 3) whose products with their transposes are `information`, which may be singular."""
    values, vectors = np.linalg.eigh(information)
    result: Floats = vectors * np.sqrt(values.clip(0.0))[:, None, :]
    return result
