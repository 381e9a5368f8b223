"""Moves of single objects to clusters of their neighbours, and what they gain."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.sub_maps.mixture import Mixture, Scene, summed


class Moves(NamedTuple):
    """Objects (m,), the clusters that they may move to, and by how much each move raises the
    logarithm of the probability.
    """

    objects: Indices
    targets: Indices
    gains: Floats

    def select(self, chosen: Booleans | Indices) -> Moves:
        """Choose some of the moves."""
        return Moves(self.objects[chosen], self.targets[chosen], self.gains[chosen])


def best_moves(mixture: Mixture, scene: Scene, labels: Indices, min_gain: float) -> Moves:
    """Find the best move of each object that gains at least so much by one."""
    first, second = scene.edges.T
    is_between = labels[first] != labels[second]
    at_border = np.zeros(len(labels), bool)
    at_border[first[is_between]] = True
    at_border[second[is_between]] = True

    # Of each object with a neighbour in another cluster, and each cluster of its neighbours: the
    # sum of the bonds between them.
    ends = np.concatenate([first, second])
    others = np.concatenate([second, first])
    chosen = at_border[ends]
    clusters = int(labels.max(initial=-1)) + 1
    keys = ends[chosen] * clusters + labels[others[chosen]]
    found, number = np.unique(keys, return_inverse=True)
    bonds = np.bincount(number, np.concatenate([scene.bonds, scene.bonds])[chosen], len(found))
    objects, targets = np.divmod(found, max(1, clusters))

    is_own = targets == labels[objects]
    own_bonds = np.zeros(len(labels))
    own_bonds[objects[is_own]] = bonds[is_own]

    # Every move to another cluster gains the bonds there, less those of the own one.
    by_bonds = Moves(objects, targets, bonds - own_bonds[objects])
    possible = by_bonds.select(~is_own)
    statistics = summed(scene.rows, labels)
    evidence = mixture.log_evidence(statistics)

    rows = scene.rows[possible.objects]
    target = possible.targets
    own = labels[possible.objects]
    joined = mixture.log_evidence(statistics[target] + rows) - evidence[target]
    left = mixture.log_evidence(statistics[own] - rows) - evidence[own]

    moves = possible._replace(gains=possible.gains + joined + left)
    gainful = moves.select(moves.gains >= min_gain)

    # Of each object the move that gains most; of equal ones, the first.
    ordered = gainful.select(np.lexsort((-gainful.gains, gainful.objects)))
    is_best = np.ones(len(ordered.objects), bool)
    is_best[1:] = ordered.objects[1:] != ordered.objects[:-1]
    return ordered.select(is_best)


def gain_most(scene: Scene, moves: Moves) -> Moves:
    """Choose the moves that gain more than those of all neighbours; of equal ones, the first."""
    count = len(scene.rows)
    order = np.lexsort((moves.objects, -moves.gains))
    rank = np.full(count, count)
    rank[moves.objects[order]] = np.arange(len(order))

    best_beside = np.full(count, count)
    first, second = scene.edges.T
    np.minimum.at(best_beside, first, rank[second])
    np.minimum.at(best_beside, second, rank[first])
    return moves.select(rank[moves.objects] < best_beside[moves.objects])
