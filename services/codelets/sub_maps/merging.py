"""Clusters that merge, pair by pair: what each merger would gain is computed once."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.sub_maps.mixture import COUNT, Mixture, Scene, summed


class Merging:
    """Clusters, numbered from 0 to `count` - 1, and the `pairs` of neighbours among them, (p, 2),
    the lower number first.
    """

    def __init__(self, mixture: Mixture, scene: Scene, labels: Indices) -> None:
        self._mixture = mixture
        self._statistics = summed(scene.rows, labels)
        self._evidence = mixture.log_evidence(self._statistics)
        self._number = np.arange(self.count)

        self.pairs = np.zeros((0, 2), np.int64)
        self._bonds = np.zeros(0)
        self._gains = np.zeros(0)
        no_gains = np.zeros(len(scene.edges))
        every_cluster = np.ones(self.count, bool)
        self._set_pairs(labels[scene.edges], scene.bonds, no_gains, every_cluster)

    @property
    def count(self) -> int:
        """Return how many clusters there are."""
        return len(self._statistics)

    def scores(self, floor: float) -> Floats:
        """Compute by how much merging each pair raises the logarithm of the probability, for each
        object of the smaller cluster, (p,); -inf if it gains no more than `floor`.
        """
        sizes = self._statistics[:, COUNT]
        smaller = sizes[self.pairs].min(axis=1)
        scores: Floats = np.where(self._gains > floor, self._gains / smaller, -np.inf)
        return scores

    def merge(self, chosen: Indices) -> None:
        """Merge pairs, (m,), of which no two share a cluster."""
        kept, gone = self.pairs[chosen].T
        self._statistics[kept] += self._statistics[gone]
        self._evidence[kept] = self._mixture.log_evidence(self._statistics[kept])

        is_left = np.ones(self.count, bool)
        is_left[gone] = False
        number = np.cumsum(is_left) - 1
        number[gone] = number[kept]

        is_changed = np.zeros(int(is_left.sum()), bool)
        is_changed[number[kept]] = True
        self._statistics = self._statistics[is_left]
        self._evidence = self._evidence[is_left]
        self._number = number[self._number]
        self._set_pairs(number[self.pairs], self._bonds, self._gains, is_changed)

    def labels(self, labels: Indices) -> Indices:
        """Return the labels of objects now, (n,), by those that they had at first."""
        now: Indices = self._number[labels]
        return now

    def _set_pairs(self, ends: Indices, bonds: Floats, gains: Floats, is_changed: Booleans) -> None:
        """Take pairs of clusters, (q, 2), some of which may be the same pair, or a cluster with
        itself. The gains of pairs with a cluster that is changed, (count,), are computed anew.
        """
        is_between = ends[:, 0] != ends[:, 1]
        low = ends[is_between].min(axis=1)
        high = ends[is_between].max(axis=1)
        keys, pair = np.unique(low * self.count + high, return_inverse=True)

        self.pairs = np.column_stack(np.divmod(keys, max(1, self.count)))
        self._bonds = np.bincount(pair, bonds[is_between], len(keys)).astype(np.float64)
        self._gains = np.zeros(len(keys))
        self._gains[pair] = gains[is_between]

        is_new = is_changed[self.pairs].any(axis=1)
        first, second = self.pairs[is_new].T
        together = self._mixture.log_evidence(self._statistics[first] + self._statistics[second])
        apart = self._evidence[first] + self._evidence[second]
        self._gains[is_new] = together - apart + self._bonds[is_new]
