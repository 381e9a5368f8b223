"""The search for the most probable partition: clusters merge, objects move, clusters are parted.

Each step raises the probability of the partition, so the search ends at a local maximum. It draws
no random numbers. All that is done at once in one step is far enough apart not to matter to one
another, which lets a step be computed for all objects in one pass.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.services.codelets.sub_maps.merging import Merging
from cogmap.services.codelets.sub_maps.mixture import Mixture, Scene
from cogmap.services.codelets.sub_maps.moves import best_moves, gain_most

# A bound: as each step raises the probability, sweeps end by themselves, and so do rounds.
MAX_SWEEPS = 50
# By how many times there are fewer pieces at each level.
PIECES_A_LEVEL = 4
MAX_ROUNDS = 8
# Of the logarithm of the probability: more than rounding errors.
MIN_GAIN = 1e-6


def partition(mixture: Mixture, scene: Scene, labels: Indices | None = None) -> Indices:
    """Find a probable partition, and return the labels of its clusters, (n,), from 0. Start from
    `labels`, or if there are none from every object for itself.
    """
    if labels is None:
        labels = np.arange(len(scene.rows))
    best = compact(labels)

    for _ in range(MAX_ROUNDS):
        merged = merge_clusters(mixture, scene, best)
        moved = move_pieces(mixture, scene, merged)
        parted = part_clusters(mixture, scene, moved)
        if np.array_equal(parted, best):
            break
        best = parted

    return best


def compact(labels: Indices) -> Indices:
    """Renumber the labels of a partition, (n,), from 0 without a gap, in their order."""
    _, numbers = np.unique(labels, return_inverse=True)
    compacted: Indices = numbers.astype(np.int64)
    return compacted


def merge_clusters(mixture: Mixture, scene: Scene, labels: Indices, at_least: int = 0) -> Indices:
    """Merge neighbouring clusters as long as that raises the probability; with `at_least`, as long
    as there are more clusters than that, whatever it does to the probability.

    In each round two clusters merge if each gains most with the other. A gain is counted by the
    objects of the smaller one: otherwise the largest would take all.
    """
    merging = Merging(mixture, scene, labels)
    floor = -np.inf if at_least else MIN_GAIN
    while merging.count > max(1, at_least):
        scores = merging.scores(floor)
        order = np.lexsort((np.arange(len(scores)), -scores))
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))

        # The pairs that are the best of both: no cluster is in two.
        best = np.full(merging.count, len(scores))
        np.minimum.at(best, merging.pairs[:, 0], rank)
        np.minimum.at(best, merging.pairs[:, 1], rank)
        is_best = (best[merging.pairs] == rank[:, None]).all(axis=1)
        chosen = np.flatnonzero(is_best & np.isfinite(scores))
        if not len(chosen):
            break

        if at_least:
            spare = merging.count - at_least
            chosen = chosen[np.argsort(-scores[chosen], kind="stable")][:spare]
        merging.merge(chosen)

    return merging.labels(labels)


def move_objects(mixture: Mixture, scene: Scene, labels: Indices) -> Indices:
    """Move objects to clusters of their neighbours as long as that raises the probability.

    Of neighbours, only the one that gains most moves in one sweep.
    """
    labels = labels.copy()
    for _ in range(MAX_SWEEPS):
        moves = best_moves(mixture, scene, labels, MIN_GAIN)
        if not len(moves.objects):
            break

        chosen = gain_most(scene, moves)
        labels[chosen.objects] = chosen.targets

    return compact(labels)


def move_pieces(mixture: Mixture, scene: Scene, labels: Indices) -> Indices:
    """Move pieces of clusters to neighbouring ones as long as that raises the probability: large
    pieces first, then smaller ones, then single objects.

    Pieces are what the objects of a cluster merge to, a quarter as many at each level.
    """
    within = scene.within(labels)
    levels = [np.arange(len(labels))]
    clusters = int(labels.max(initial=-1)) + 1
    while True:
        finer = levels[-1]
        count = int(finer.max(initial=-1)) + 1
        wanted = count // PIECES_A_LEVEL
        if wanted <= clusters:
            break

        coarser = merge_clusters(mixture, within, finer, at_least=wanted)
        if int(coarser.max()) + 1 == count:
            break
        levels.append(coarser)

    for pieces in reversed(levels):
        coarse = scene.merged(pieces)
        first = np.unique(pieces, return_index=True)[1]
        labels = compact(move_objects(mixture, coarse, labels[first]))[pieces]

    return compact(labels)


def part_clusters(mixture: Mixture, scene: Scene, labels: Indices) -> Indices:
    """Part each cluster in two or more if that raises the probability."""
    labels = labels.copy()
    clusters = int(labels.max(initial=-1)) + 1
    for cluster in range(clusters):
        members = np.flatnonzero(labels == cluster)
        part = parts(mixture, scene.part(members))
        is_other = part > 0
        labels[members[is_other]] = int(labels.max()) + part[is_other]

    return labels


def parts(mixture: Mixture, scene: Scene) -> Indices:
    """Find in which part of one cluster each of its objects is better, (n,), from 0; 0 of all if
    the cluster is best as it is.

    It may have two parts, or as many as there are when no two gain by merging.
    """
    best = np.zeros(len(scene.rows), np.int64)
    most = mixture.log_probability(scene, best) + MIN_GAIN
    found = np.arange(len(best))

    for at_least in (0, 2):
        found = merge_clusters(mixture, scene, found, at_least)
        moved = move_objects(mixture, scene, found)
        probability = mixture.log_probability(scene, moved)
        if probability > most:
            most = probability
            best = moved

    return best
