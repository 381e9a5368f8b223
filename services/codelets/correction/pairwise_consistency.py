"""Which views that may close a loop agree: one alone may be of another place or landmark than it
seems to be.

Three that agree with one another count (beyond the paper, whose landmarks are never taken for
others). Two agree where what they join lies as far apart here as it did there, by path integration
between them alone: nothing that the agent believes of where it is comes into it (pairwise
consistency, as in Mangelson et al. 2018).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.special import chdtri

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices, wrap_angle
from services.codelets.correction.pose_graph import Constraints

MIN_AGREEING = 3
# Views further apart than that on the way say nothing of one another: anything would agree.
WIDEST_M = 5.0
NEXT = 32


class Views(NamedTuple):
    """View k, from row `j[k]` of the path, of what stands at `there_m` (m, 2) as seen from row
    `i[k]`.

    It is seen at `here_m` (m, 2), x forward, y left, to `sd_m`; how the two rows are turned is
    known to `sd_rad`, or, where that is 0, not.
    """

    i: Indices
    j: Indices
    there_m: Floats
    here_m: Floats
    sd_m: Floats
    sd_rad: Floats

    def select(self, chosen: Booleans | Indices) -> Views:
        """Some of them."""
        ends = (self.i[chosen], self.j[chosen])
        points = (self.there_m[chosen], self.here_m[chosen])
        return Views(*ends, *points, self.sd_m[chosen], self.sd_rad[chosen])


def consistent(views: Views, steps: Constraints, false_closure: float) -> Booleans:
    """(m,): which of the views are among MIN_AGREEING that agree with one another, on a path of
    `steps`.
    """
    count = len(views.i)
    order = np.lexsort((np.arange(count), views.j))
    way = _Way(steps)
    pairs = [
        np.column_stack([order[:-apart], order[apart:]]) for apart in range(1, min(NEXT, count))
    ]
    both = np.vstack([np.zeros((0, 2), np.int64), *pairs])
    one, other = both[
        _agree(views.select(both[:, 0]), views.select(both[:, 1]), way, false_closure)
    ].T
    touching = sparse.csr_array(
        (np.ones(2 * len(one)), (np.r_[one, other], np.r_[other, one])), shape=(count, count)
    )
    triangles = (touching @ touching).multiply(touching).sum(axis=1)
    result: Booleans = np.asarray(triangles).ravel() > 0
    return result


class _Way:
    """A path as path integration alone has it, from where it begins, and how unsure that becomes."""

    def __init__(self, steps: Constraints) -> None:
        self.heading = np.concatenate([[0.0], np.cumsum(steps.measurement[:, 2])])
        moved = np.einsum(
            "mab,mb->ma", rotation_matrices(self.heading[:-1]), steps.measurement[:, :2]
        )
        self.where = np.vstack([np.zeros(2), np.cumsum(moved, axis=0)])
        self.length = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.measurement[:, :2].T))])
        self.variance = np.concatenate([[0.0], np.cumsum(1 / steps.information[:, 0, 0])])
        self.turning = np.concatenate([[0.0], np.cumsum(1 / steps.information[:, 2, 2])])

    def seen(self, rows: Indices, off_m: Floats) -> Floats:
        """(m, 2): where things are that are seen from rows."""
        result: Floats = self.where[rows] + np.einsum(
            "mab,mb->ma", rotation_matrices(self.heading[rows]), off_m
        )
        return result

    def unsure_m2(self, rows: Indices, others: Indices, lever_m: Floats) -> Floats:
        """(m,): the variance of where things that far away seem to be between two rows."""
        length = np.abs(self.length[rows] - self.length[others])
        turning = np.abs(self.turning[rows] - self.turning[others])
        result: Floats = np.abs(self.variance[rows] - self.variance[others]) + turning * (
            length**2 / 3 + lever_m**2
        )
        return result


def _agree(one: Views, other: Views, way: _Way, false_closure: float) -> Booleans:
    there = np.hypot(*(way.seen(one.i, one.there_m) - way.seen(other.i, other.there_m)).T)
    here = np.hypot(*(way.seen(one.j, one.here_m) - way.seen(other.j, other.here_m)).T)
    unsure = way.unsure_m2(one.i, other.i, _lever(one.there_m, other.there_m))
    unsure += way.unsure_m2(one.j, other.j, _lever(one.here_m, other.here_m))
    squared = (there - here) ** 2 / (one.sd_m**2 + other.sd_m**2 + unsure)
    turns = (one.sd_rad > 0) & (other.sd_rad > 0)
    heading = way.heading
    turned = wrap_angle(heading[one.j] - heading[other.j] - heading[one.i] + heading[other.i])
    turning = np.abs(way.turning[one.i] - way.turning[other.i])
    turning += np.abs(way.turning[one.j] - way.turning[other.j])
    squared[turns] += (turned**2 / np.maximum(one.sd_rad**2 + other.sd_rad**2 + turning, 1e-12))[
        turns
    ]
    degrees = np.where(turns, 3, 2)
    near = (unsure <= WIDEST_M**2) & (one.j != other.j)
    agree: Booleans = near & (squared <= chdtri(degrees, false_closure))
    return agree


def _lever(one_m: Floats, other_m: Floats) -> Floats:
    lever: Floats = np.maximum(np.hypot(*one_m.T), np.hypot(*other_m.T))
    return lever
