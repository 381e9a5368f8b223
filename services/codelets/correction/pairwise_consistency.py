"""Which loop closures agree with one another: a single view may be of another place or landmark
than it seems.

Beyond the paper, whose landmarks are never confused. Two closures agree where what they join is as
far apart on this pass as it was on the earlier one, by path integration within each pass alone;
what the agent believes of its pose is not used. At least MIN_AGREEING must agree with one another
(pairwise consistency, as in Mangelson et al. 2018, doi 10.1109/ICRA.2018.8460217).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.special import chdtri

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import cumulative, integrate, transform_from, wrap_angle
from services.codelets.correction.pose_graph import Constraints

MIN_AGREEING = 3
# With more uncertainty between them than this, any two views would agree.
MAX_SD_M = 5.0
# Each view is compared with so many that follow it.
NEIGHBOURS = 31


class Views(NamedTuple):
    """m views from places `j` (m,) of the path, of what was seen from places `i` (m,) before.

    It stands at `there_m` (m, 2) in the frame of place i and at `here_m` (m, 2) in that of place j,
    x forward, y left, known to `sd_m` (m,). The heading between the two places is known to
    `sd_rad` (m,), or unknown where that is 0.
    """

    i: Indices
    j: Indices
    there_m: Floats
    here_m: Floats
    sd_m: Floats
    sd_rad: Floats

    def select(self, chosen: Booleans | Indices) -> Views:
        """The chosen ones, by mask or indices."""
        return Views(
            i=self.i[chosen],
            j=self.j[chosen],
            there_m=self.there_m[chosen],
            here_m=self.here_m[chosen],
            sd_m=self.sd_m[chosen],
            sd_rad=self.sd_rad[chosen],
        )


def consistent(views: Views, steps: Constraints, false_closure: float) -> Booleans:
    """(m,): which views are among MIN_AGREEING that all agree with one another.

    `steps` are those of the path; views that agree are taken for disagreeing with probability
    `false_closure`.
    """
    one, other = _pairs(views)
    agree = _agree(views.select(one), views.select(other), _DeadReckoning(steps), false_closure)
    one = one[agree]
    other = other[agree]

    count = len(views.i)
    rows = np.concatenate([one, other])
    columns = np.concatenate([other, one])
    adjacency = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    triangles = (adjacency @ adjacency).multiply(adjacency).sum(axis=1)
    return np.asarray(triangles).ravel() > 0


def _pairs(views: Views) -> tuple[Indices, Indices]:
    """Pairs of views to compare, by number: each with those that follow it along the path."""
    count = len(views.i)
    order = np.lexsort((np.arange(count), views.j))
    nothing = np.zeros(0, np.int64)
    ones = [nothing]
    others = [nothing]
    for apart in range(1, min(NEIGHBOURS + 1, count)):
        ones.append(order[:-apart])
        others.append(order[apart:])
    return np.concatenate(ones), np.concatenate(others)


class _DeadReckoning:
    """A path by path integration alone, from its beginning, and the variances summed along it."""

    def __init__(self, steps: Constraints) -> None:
        self.poses = integrate(np.zeros(3), steps.measurement)
        lengths_m = _lengths(steps.measurement[:, :2])
        step_m2 = 1 / steps.information[:, 0, 0]
        step_rad2 = 1 / steps.information[:, 2, 2]

        self._length_m = cumulative(lengths_m)
        self._variance_m2 = cumulative(step_m2)
        self._variance_rad2 = cumulative(step_rad2)

    def between_m(self, one: Indices, one_m: Floats, other: Indices, other_m: Floats) -> Floats:
        """(m,): the distance between points seen from two places each, given in their frames."""
        first_m = transform_from(self.poses[one], one_m)
        second_m = transform_from(self.poses[other], other_m)
        return _lengths(first_m - second_m)

    def variance_m2(self, one: Indices, one_m: Floats, other: Indices, other_m: Floats) -> Floats:
        """(m,): the variance of `between_m`: of the steps, and of the turns at their lever arm."""
        length_m = _between(self._length_m, one, other)
        lever_arm_m = np.maximum(_lengths(one_m), _lengths(other_m))
        lever_m2 = length_m**2 / 3 + lever_arm_m**2

        by_steps_m2 = _between(self._variance_m2, one, other)
        by_turns_m2 = self.variance_rad2(one, other) * lever_m2
        variance_m2: Floats = by_steps_m2 + by_turns_m2
        return variance_m2

    def variance_rad2(self, one: Indices, other: Indices) -> Floats:
        """(m,): the variance of the heading between two places each."""
        return _between(self._variance_rad2, one, other)


def _between(summed: Floats, one: Indices, other: Indices) -> Floats:
    """(m,): how much a running sum changes between two places each, in either direction."""
    change = summed[one] - summed[other]
    return np.asarray(np.abs(change))


def _lengths(vectors: Floats) -> Floats:
    """(m,): the lengths of (m, 2) vectors."""
    x, y = vectors.T
    return np.asarray(np.hypot(x, y))


def _agree(one: Views, other: Views, path: _DeadReckoning, false_closure: float) -> Booleans:
    """(m,): which pairs of views agree."""
    there = (one.i, one.there_m, other.i, other.there_m)
    here = (one.j, one.here_m, other.j, other.here_m)
    difference_m = path.between_m(*there) - path.between_m(*here)

    path_m2 = path.variance_m2(*there) + path.variance_m2(*here)
    variance_m2 = one.sd_m**2 + other.sd_m**2 + path_m2
    squared = difference_m**2 / variance_m2

    has_heading = (one.sd_rad > 0) & (other.sd_rad > 0)
    squared += np.where(has_heading, _turn_squared(one, other, path), 0.0)

    degrees = np.where(has_heading, 3, 2)
    is_consistent = squared <= chdtri(degrees, false_closure)

    is_near = path_m2 <= MAX_SD_M**2
    is_apart = one.j != other.j
    agree: Booleans = is_consistent & is_near & is_apart
    return agree


def _turn_squared(one: Views, other: Views, path: _DeadReckoning) -> Floats:
    """(m,): the squared Mahalanobis distance of the turn between two views on either pass."""
    headings = path.poses[:, 2]
    here = headings[one.j] - headings[other.j]
    there = headings[one.i] - headings[other.i]
    turned = wrap_angle(here - there)

    there_rad2 = path.variance_rad2(one.i, other.i)
    here_rad2 = path.variance_rad2(one.j, other.j)
    seen_rad2 = one.sd_rad**2 + other.sd_rad**2
    variance_rad2 = seen_rad2 + there_rad2 + here_rad2

    squared: Floats = turned**2 / np.maximum(variance_rad2, 1e-12)
    return squared
