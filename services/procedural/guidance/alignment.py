"""The motion of the agent between two views of the same landmarks, by 2-D least squares. Pure.

Positions are complex numbers in the frame of the robot, metres ahead + metres left x i.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.estimation.alignment import motion_onto
from cogmap.schemas.cognition import Relation

# Errors of a landmark between two views: when near, and as a share of its range, about 1.4 times
# the 2.5 % of one view. And of the turn between them: along one route it is small.
NEAR_SD_M = 0.3
RANGE_SD_SHARE = 0.04
PRIOR_SD_RAD = 0.3
GATE = 3.0
"""A landmark that is so many standard deviations from where the others have it is another one."""


class Motion(NamedTuple):
    """A rigid motion of the plane: rotated by a complex number of length 1, then shifted."""

    rotation: complex
    shift_m: complex

    @property
    def turn_rad(self) -> float:
        """Return the angle of the rotation, left positive."""
        return cmath.phase(self.rotation)

    def moved(self, point_m: complex) -> complex:
        """Return where the motion brings a point."""
        return self.rotation * point_m + self.shift_m

    def origin_before(self) -> complex:
        """Return the point that the motion brings to the origin: where the robot is now, as seen
        from where it was.
        """
        return -self.shift_m * self.rotation.conjugate()


class Pair(NamedTuple):
    """A landmark as it stood then and as it stands now, by its number among those of either."""

    number: int
    seen: int
    then_m: complex
    now_m: complex

    @property
    def sd_m(self) -> float:
        """Return the standard deviation of the difference: the farther away, the greater."""
        return NEAR_SD_M + RANGE_SD_SHARE * abs(self.now_m)


def position_m(relation: Relation) -> complex:
    """Return where an object stands."""
    return cmath.rect(relation.range_m, relation.bearing_rad)


def pairs_of(then: Sequence[Relation], now: Sequence[Relation]) -> list[Pair]:
    """Pair each landmark with the nearest object of its look that no other has; leave out those
    that have none.
    """
    distances = []
    for i, before in enumerate(then):
        for j, after in enumerate(now):
            if before.look == after.look:
                distances.append((abs(position_m(after) - position_m(before)), i, j))

    found: dict[int, Pair] = {}
    taken = set()
    for _, i, j in sorted(distances):
        if i not in found and j not in taken:
            taken.add(j)
            found[i] = Pair(i, j, position_m(then[i]), position_m(now[j]))

    return list(found.values())


def aligned(pairs: Sequence[Pair]) -> tuple[Motion, list[Pair]] | None:
    """Find the motion that brings landmarks from where they stood to where they stand, and those
    that agree with it; None if fewer than two of several agree. One alone moves without turning.
    """
    left = list(pairs)
    while left:
        motion = _least_squares(left)
        worst = max(left, key=lambda pair: _misfit(pair, motion))
        if _misfit(worst, motion) <= GATE:
            return motion, left
        if len(left) == 2:
            return None
        left.remove(worst)

    return None


def _misfit(pair: Pair, motion: Motion) -> float:
    return abs(motion.moved(pair.then_m) - pair.now_m) / pair.sd_m


def _least_squares(pairs: Sequence[Pair]) -> Motion:
    """Fit the best weighted rotation and shift, with a prior for a small rotation."""
    then_m = np.array([(pair.then_m.real, pair.then_m.imag) for pair in pairs])
    now_m = np.array([(pair.now_m.real, pair.now_m.imag) for pair in pairs])
    weights = np.array([pair.sd_m**-2 for pair in pairs])
    x_m, y_m, turn_rad = motion_onto(then_m, now_m, weights, PRIOR_SD_RAD**-2).tolist()
    return Motion(cmath.rect(1.0, turn_rad), complex(x_m, y_m))
