"""A path with what is known between its poses: path integration from each to the next, and loops
closed (eq. 5-7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.errors import MessageError
from services.codelets.localization.sampling import wrapped

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Constraints:
    """Constraint k says where pose `second[k]` is as seen from pose `first[k]`.

    `measured` (m, 3) is dx_m, dy_m, dheading_rad; `information` (m, 3, 3) the inverse of its
    covariance, with zeros where nothing is known of the heading.
    """

    first: Indices
    second: Indices
    measured: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.first)

    def select(self, chosen: npt.NDArray[np.bool_] | Indices | slice) -> Constraints:
        """Some of them."""
        return Constraints(
            self.first[chosen], self.second[chosen], self.measured[chosen], self.information[chosen]
        )

    def weighted(self, weights: Floats) -> Constraints:
        """The same, each believed as much as its weight says."""
        return Constraints(
            self.first, self.second, self.measured, self.information * weights[:, None, None]
        )

    def __add__(self, other: Constraints) -> Constraints:
        return Constraints(
            np.concatenate([self.first, other.first]),
            np.concatenate([self.second, other.second]),
            np.concatenate([self.measured, other.measured]),
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
        following = np.flatnonzero(constraints.second == constraints.first + 1)
        _, once = np.unique(constraints.first[following], return_index=True)
        steps = following[once]
        if len(steps) != len(poses) - 1:
            missing = np.setdiff1d(np.arange(len(poses) - 1), constraints.first[steps])
            raise MessageError(
                f"nothing is known from pose {missing[0]} to the next: a path has every step"
            )
        rest = np.setdiff1d(np.arange(len(constraints)), steps)
        return cls(poses, constraints.select(steps), constraints.select(rest))

    @property
    def constraints(self) -> Constraints:
        """All of them, the steps first."""
        return self.steps + self.closures


def relative(poses: Floats, constraints: Constraints) -> Floats:
    """(m, 3): the second pose of each constraint as seen from the first, the heading not wrapped."""
    first = poses[constraints.first]
    off = poses[constraints.second] - poses[constraints.first]
    cos = np.cos(first[:, 2])
    sin = np.sin(first[:, 2])
    return np.column_stack(
        [cos * off[:, 0] + sin * off[:, 1], cos * off[:, 1] - sin * off[:, 0], off[:, 2]]
    )


def discrepancies(poses: Floats, constraints: Constraints) -> Floats:
    """(m, 3): by how much `poses` disagree with each constraint, as seen from its first pose."""
    off = relative(poses, constraints) - constraints.measured
    off[:, 2] = wrapped(off[:, 2])
    return off


def squared(off: Floats, information: Floats) -> Floats:
    """(m,): the terms d' S^-1 d of eq. 7."""
    result: Floats = np.einsum("ma,mab,mb->m", off, information, off)
    return result


def cost(poses: Floats, constraints: Constraints) -> float:
    """Eq. 7, headings and all."""
    return float(squared(discrepancies(poses, constraints), constraints.information).sum())


def jacobians(poses: Floats, constraints: Constraints) -> tuple[Floats, Floats]:
    """(m, 3, 3) each: how the discrepancy of each constraint changes with its first and with its
    second pose.
    """
    seen = relative(poses, constraints)
    by_second = np.zeros((len(constraints), 3, 3))
    by_second[:, :2, :2] = rotations(-poses[constraints.first, 2])
    by_second[:, 2, 2] = 1.0
    by_first = -by_second
    by_first[:, 0, 2], by_first[:, 1, 2] = seen[:, 1], -seen[:, 0]
    return by_first, by_second


def roots(information: Floats) -> Floats:
    """(m, 3, 3) whose products with their transposes are `information`, which may be singular."""
    values, vectors = np.linalg.eigh(information)
    result: Floats = vectors * np.sqrt(values.clip(0.0))[:, None, :]
    return result


def from_zero(steps: Floats) -> Floats:
    """Running sums, a zero before the first."""
    return np.concatenate([np.zeros((1, *steps.shape[1:])), np.cumsum(steps, axis=0)])


def rotations(heading_rad: Floats) -> Floats:
    """(n, 2, 2): from a robot's frame to the world's."""
    cos = np.cos(heading_rad)
    sin = np.sin(heading_rad)
    return np.stack([cos, -sin, sin, cos], axis=-1).reshape(-1, 2, 2)
