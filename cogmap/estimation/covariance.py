"""Joint covariances of poses that a path's constraints leave: parts of the inverse of its normal
equations, without the whole.

Takahashi et al. 1973 (Formation of a sparse bus impedance matrix and its application to short
circuit study, PICA): elimination leaves for each pose a front, itself with those that it still
depends on; its part of the inverse follows from that of the front that it is eliminated into. What
is asked for together is kept in one front.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.estimation.least_squares import elimination_order
from cogmap.estimation.pose_graph import PoseGraph, jacobians
from cogmap.geometry.arrays import Floats, Indices

SIZE = 3
ROWS = np.arange(SIZE)


class _Front(NamedTuple):
    """A pose and the later ones that it depends on, by their places in the order of elimination:
    `later` are in order. `variance` (3, 3) is the pose's where those are known, which move it by
    `weights` (3 k, 3).
    """

    later: list[int]
    variance: Floats
    weights: Floats


class _Blocks:
    """The normal equations of a graph in blocks of 3 x 3, by the order of elimination, in which
    pose `order[k]` is the one at k; `place` is -1 of the first pose, which is known.
    """

    def __init__(self, graph: PoseGraph, groups: Sequence[Indices]) -> None:
        count = len(graph.poses)
        constraints = graph.constraints
        together = [_pairs(group) for group in groups]
        pairs = np.vstack([np.column_stack([constraints.i, constraints.j]), *together])
        order = elimination_order(count, pairs[:, 0], pairs[:, 1])
        self.count = count - 1
        self.place = np.full(count, -1)
        self.place[order] = np.arange(self.count)

        by_i, by_j = jacobians(graph.poses, constraints)
        weighted_i = by_i.mT @ constraints.information
        weighted_j = by_j.mT @ constraints.information
        self.diagonal = np.zeros((self.count, SIZE, SIZE))
        for pose, block in ((constraints.i, weighted_i @ by_i), (constraints.j, weighted_j @ by_j)):
            place = self.place[pose]
            np.add.at(self.diagonal, place[place >= 0], block[place >= 0])

        # Constraints come first; pairs that are only asked for have blocks of zeros.
        places = self.place[pairs]
        across = np.zeros((len(pairs), SIZE, SIZE))
        across[: len(constraints)] = weighted_i @ by_j
        is_turned = places[:, 0] > places[:, 1]
        across[is_turned] = across[is_turned].mT

        is_free = (places >= 0).all(axis=1) & (places[:, 0] != places[:, 1])
        first = places[is_free].min(axis=1)
        last = places[is_free].max(axis=1)
        keys, target = np.unique(first * self.count + last, return_inverse=True)
        self._across = np.zeros((len(keys), SIZE, SIZE))
        np.add.at(self._across, target, across[is_free])
        self._last = keys % self.count
        self._starts = np.searchsorted(keys, np.arange(self.count + 1) * self.count)

    def across(self, place: int) -> tuple[list[int], Floats]:
        """Return the later poses that one is joined to, and the blocks (k, 3, 3) to them."""
        chosen = slice(self._starts[place], self._starts[place + 1])
        return self._last[chosen].tolist(), self._across[chosen]


def joint_covariances(graph: PoseGraph, groups: Sequence[Indices]) -> list[Floats]:
    """Return the joint covariance (3 k, 3 k) of each of `groups` of k poses, by their numbers, as
    the constraints of an optimized `graph` leave it; its first pose is known.
    """
    blocks = _Blocks(graph, groups)
    fronts = _eliminated(blocks)
    children = np.zeros(blocks.count, np.int64)
    for front in fronts:
        if front.later:
            children[front.later[0]] += 1

    placed = [blocks.place[group] for group in groups]
    asked: defaultdict[int, list[int]] = defaultdict(list)
    found = [np.zeros((SIZE * len(group), SIZE * len(group))) for group in groups]
    for number, places in enumerate(placed):
        if (places >= 0).any():
            asked[int(places[places >= 0].min())].append(number)

    # From the last pose back: the part of a front is needed until all that are eliminated into it
    # have theirs.
    parts: dict[int, Floats] = {}
    for place in range(blocks.count - 1, -1, -1):
        front = fronts[place]
        part = front.variance
        if front.later:
            parent = front.later[0]
            rows = _rows_in([parent, *fronts[parent].later], front.later)
            part = _part(front, parts[parent][rows[:, None], rows])
            children[parent] -= 1
            if not children[parent]:
                del parts[parent]
        if children[place]:
            parts[place] = part

        for number in asked[place]:
            is_free = np.flatnonzero(placed[number] >= 0)
            rows = _rows_in([place, *front.later], placed[number][is_free].tolist())
            own = np.add.outer(SIZE * is_free, ROWS).ravel()
            found[number][own[:, None], own] = part[rows[:, None], rows]
    return found


def _eliminated(blocks: _Blocks) -> list[_Front]:
    """Eliminate pose after pose, and return their fronts."""
    fronts = []
    updates: defaultdict[int, list[tuple[list[int], Floats]]] = defaultdict(list)
    for place in range(blocks.count):
        joined, across = blocks.across(place)
        passed_on = updates.pop(place, [])
        members = sorted({place, *joined}.union(*(names for names, _ in passed_on)))

        matrix = np.zeros((SIZE * len(members), SIZE * len(members)))
        matrix[:SIZE, :SIZE] = blocks.diagonal[place]
        rows = _rows_in(members, joined)
        matrix[rows, :SIZE] = across.mT.reshape(-1, SIZE)
        matrix[:SIZE, rows] = matrix[rows, :SIZE].T
        for names, update in passed_on:
            rows = _rows_in(members, names)
            matrix[rows[:, None], rows] += update

        below = matrix[SIZE:, :SIZE]
        variance = np.asarray(np.linalg.inv(matrix[:SIZE, :SIZE]), np.float64)
        weights = below @ variance
        later = members[1:]
        if later:
            updates[later[0]].append((later, matrix[SIZE:, SIZE:] - weights @ below.T))
        fronts.append(_Front(later, variance, weights))
    return fronts


def _part(front: _Front, of_later: Floats) -> Floats:
    """Return a front's part of the inverse, given that of its later poses."""
    moved = of_later @ front.weights
    size = SIZE + len(of_later)
    part = np.empty((size, size))
    part[:SIZE, :SIZE] = front.variance + front.weights.T @ moved
    part[SIZE:, :SIZE] = -moved
    part[:SIZE, SIZE:] = -moved.T
    part[SIZE:, SIZE:] = of_later
    return part


def _rows_in(members: list[int], wanted: list[int]) -> Indices:
    """Return the rows of some poses in the matrix of a front, whose `members` are in order."""
    places = [bisect_left(members, each) for each in wanted]
    rows: Indices = np.add.outer(SIZE * np.array(places, np.int64), ROWS).ravel()
    return rows


def _pairs(group: Indices) -> Indices:
    """Return all pairs of different poses of a group, (k, 2)."""
    one, other = np.triu_indices(len(group), 1)
    return np.column_stack([group[one], group[other]])
