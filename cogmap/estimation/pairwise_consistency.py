"""Which loop closures agree with one another: a single view may be of another place or landmark
than it seems.

Beyond the paper, whose landmarks are never confused. Two closures agree if what they join is as
far apart on this pass as it was on the earlier one, by path integration within each pass alone;
what the agent believes of its pose is not used. At least MIN_AGREEING must agree with one another
(pairwise consistency, as in Mangelson et al. 2018, doi 10.1109/ICRA.2018.8460217).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from cogmap.estimation.pose_graph import Constraints, adjacency
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import cumulative, integrate, transform_from, wrap_angle

# Not to be changed alone: `consistent` looks for triangles of views.
MIN_AGREEING = 3
# With more uncertainty between them than this, any two views would agree.
MAX_SD_M = 5.0
# Two views that are each more uncertain than this never agree.
MAX_VIEW_SD_M = MAX_SD_M / math.sqrt(2)
# Each view is compared with so many that follow it.
NEIGHBOURS = 31


class Points(NamedTuple):
    """m points `at_m` (m, 2), each in the frame of the path's place `place` (m,)."""

    place: Indices
    at_m: Floats

    @property
    def range_m(self) -> Floats:
        """Return how far the points are from their places, (m,)."""
        return _lengths(self.at_m)


class Views(NamedTuple):
    """m views from places `j` (m,) of the path, of what was seen from places `i` (m,) before.

    It stands at `there_m` (m, 2) in the frame of place i and at `here_m` (m, 2) in that of place j,
    x forward, y left, known to `sd_m` (m,). The heading between the two places is known to
    `sd_rad` (m,), or unknown if that is 0.
    """

    i: Indices
    j: Indices
    there_m: Floats
    here_m: Floats
    sd_m: Floats
    sd_rad: Floats

    @property
    def has_heading(self) -> Booleans:
        """Return whether the heading between the two places is known, (m,)."""
        return self.sd_rad > 0

    @property
    def there(self) -> Points:
        """Return the points that were seen, from the earlier places."""
        return Points(self.i, self.there_m)

    @property
    def here(self) -> Points:
        """Return the same points, from the later places."""
        return Points(self.j, self.here_m)

    def select(self, chosen: Booleans | Indices) -> Views:
        """Return the chosen views, by mask or indices."""
        return Views(
            i=self.i[chosen],
            j=self.j[chosen],
            there_m=self.there_m[chosen],
            here_m=self.here_m[chosen],
            sd_m=self.sd_m[chosen],
            sd_rad=self.sd_rad[chosen],
        )


def consistent(views: Views, steps: Constraints, false_closure: float) -> Booleans:
    """Mark the views that are among MIN_AGREEING that all agree with one another, (m,).

    `steps` are those of the path. Views that agree are taken for disagreeing with probability
    `false_closure`.
    """
    # Each view is compared with those that follow it along the path.
    count = len(views.i)
    order = np.lexsort((np.arange(count), views.j))
    ahead = range(1, min(NEIGHBOURS + 1, count))
    nothing = np.zeros(0, np.int64)
    one = np.concatenate([nothing, *(order[:-apart] for apart in ahead)])
    other = np.concatenate([nothing, *(order[apart:] for apart in ahead)])

    path = _DeadReckoning(steps)
    agree = _agree(views.select(one), views.select(other), path, false_closure)

    joined = adjacency(one[agree], other[agree], count)
    joined_by_one = joined @ joined

    triangles = joined_by_one.multiply(joined).sum(axis=1)
    return np.asarray(triangles).ravel() > 0


class _DeadReckoning:
    """A path by path integration alone, from its beginning, and the variances summed along it."""

    def __init__(self, steps: Constraints) -> None:
        origin = np.zeros(3)
        self.poses = integrate(origin, steps.measurement)

        lengths_m = _lengths(steps.measurement[:, :2])
        self._length_m = cumulative(lengths_m)
        self._variance_m2 = cumulative(steps.variance_m2)
        self._variance_rad2 = cumulative(steps.variance_rad2)

    def between_m(self, one: Points, other: Points) -> Floats:
        """Measure the distance between each point of `one` and that of `other`, (m,)."""
        pose = self.poses[one.place]
        other_pose = self.poses[other.place]

        point_m = transform_from(pose, one.at_m)
        other_point_m = transform_from(other_pose, other.at_m)
        return _lengths(point_m - other_point_m)

    def variance_m2(self, one: Points, other: Points) -> Floats:
        """Return the variance of `between_m`, (m,): of steps, and of turns at their lever arm."""
        length_m = _between(self._length_m, one.place, other.place)
        lever_arm_m = np.maximum(one.range_m, other.range_m)
        lever_m2 = length_m**2 / 3 + lever_arm_m**2

        by_steps_m2 = _between(self._variance_m2, one.place, other.place)
        turn_rad2 = self.variance_rad2(one.place, other.place)
        by_turns_m2 = turn_rad2 * lever_m2
        variance_m2: Floats = by_steps_m2 + by_turns_m2
        return variance_m2

    def turn_rad(self, one: Indices, other: Indices) -> Floats:
        """Return the heading at one place less that at another, (m,)."""
        headings_rad = self.poses[:, 2]

        turn_rad: Floats = headings_rad[one] - headings_rad[other]
        return turn_rad

    def variance_rad2(self, one: Indices, other: Indices) -> Floats:
        """Return the variance of `turn_rad`, (m,)."""
        return _between(self._variance_rad2, one, other)


def _between(summed: Floats, one: Indices, other: Indices) -> Floats:
    """Return how much a running sum changes between two places each, (m,), in either direction."""
    change = summed[one] - summed[other]
    return np.asarray(np.abs(change))


def _lengths(vectors: Floats) -> Floats:
    """Compute the lengths (m,) of (m, 2) vectors."""
    x, y = vectors.T
    return np.asarray(np.hypot(x, y))


def _agree(one: Views, other: Views, path: _DeadReckoning, false_closure: float) -> Booleans:
    """Mark the pairs of views that agree, (m,)."""
    there_m2 = path.variance_m2(one.there, other.there)
    here_m2 = path.variance_m2(one.here, other.here)
    path_m2 = there_m2 + here_m2

    # How far apart the two views' points are on either pass, in squared Mahalanobis distance.
    difference_m = path.between_m(one.there, other.there) - path.between_m(one.here, other.here)
    variance_m2 = one.sd_m**2 + other.sd_m**2 + path_m2
    squared = difference_m**2 / variance_m2

    # The turn between the two views on either pass, if both know their heading.
    has_heading = one.has_heading & other.has_heading
    turned_rad = wrap_angle(path.turn_rad(one.j, other.j) - path.turn_rad(one.i, other.i))
    seen_rad2 = one.sd_rad**2 + other.sd_rad**2
    there_rad2 = path.variance_rad2(one.i, other.i)
    here_rad2 = path.variance_rad2(one.j, other.j)
    variance_rad2 = np.maximum(seen_rad2 + there_rad2 + here_rad2, 1e-12)
    squared += np.where(has_heading, turned_rad**2 / variance_rad2, 0.0)

    degrees = np.where(has_heading, 3, 2)
    is_consistent = squared <= chdtri(degrees, false_closure)

    is_certain = variance_m2 <= MAX_SD_M**2
    is_apart = one.j != other.j
    agree: Booleans = is_consistent & is_certain & is_apart
    return agree
