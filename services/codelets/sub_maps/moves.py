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
        """Some of the moves."""
        return Moves(self.objects[chosen], self.targets[chosen], self.gains[chosen])


def best_moves(mixture: Mixture, scene: Scene, labels: Indices, min_gain: float) -> Moves:
    """The best move of each object that gains at least so much by one."""
    possible = _by_bonds(scene, labels)
    statistics = summed(scene.rows, labels)
    evidence = mixture.log_evidence(statistics)

    rows = scene.rows[possible.objects]
    target = possible.targets
    own = labels[possible.objects]
    joined = mixture.log_evidence(statistics[target] + rows) - evidence[target]
    left = mixture.log_evidence(statistics[own] - rows) - evidence[own]

    moves = possible._replace(gains=possible.gains + joined + left)
    return _best_of_each(moves.select(moves.gains >= min_gain))


def gain_most(scene: Scene, moves: Moves) -> Moves:
    """The moves that gain more than those of all neighbours; of equal ones, the first."""
    count = len(scene.rows)
    order = np.lexsort((moves.objects, -moves.gains))
    rank = np.full(count, count)
    rank[moves.objects[order]] = np.arange(len(order))

    best_beside = np.full(count, count)
    first, second = scene.edges.T
    np.minimum.at(best_beside, first, rank[second])
    np.minimum.at(best_beside, second, rank[first])
    return moves.select(rank[moves.objects] < best_beside[moves.objects])


def _by_bonds(scene: Scene, labels: Indices) -> Moves:
    """Every move of an object to a cluster of its neighbours, and what it gains by its bonds."""
    clusters = int(labels.max(initial=-1)) + 1
    keys, bonds = _bonds_to_clusters(scene, labels, clusters)
    objects, targets = np.divmod(keys, max(1, clusters))

    is_own = targets == labels[objects]
    own_bonds = np.zeros(len(labels))
    own_bonds[objects[is_own]] = bonds[is_own]

    gained = Moves(objects, targets, bonds - own_bonds[objects])
    return gained.select(~is_own)


def _bonds_to_clusters(scene: Scene, labels: Indices, clusters: int) -> tuple[Indices, Floats]:
    """Of each object with a neighbour in another cluster, and each cluster of its neighbours: both
    as object * clusters + cluster, and the sum of the bonds between them.
    """
    first, second = scene.edges.T
    is_between = labels[first] != labels[second]
    at_border = np.zeros(len(labels), bool)
    at_border[first[is_between]] = True
    at_border[second[is_between]] = True

    ends = np.concatenate([first, second])
    others = np.concatenate([second, first])
    bonds = np.concatenate([scene.bonds, scene.bonds])
    chosen = at_border[ends]

    keys = ends[chosen] * clusters + labels[others[chosen]]
    found, number = np.unique(keys, return_inverse=True)
    summed_bonds = np.bincount(number, bonds[chosen], len(found))
    return found, np.asarray(summed_bonds, np.float64)


def _best_of_each(moves: Moves) -> Moves:
    """Of each object the move that gains most; of equal ones, the first."""
    order = np.lexsort((-moves.gains, moves.objects))
    ordered = moves.select(order)

    is_best = np.ones(len(order), bool)
    is_best[1:] = ordered.objects[1:] != ordered.objects[:-1]
    return ordered.select(is_best)
