"""Objects and the sub-map of each: found for all at once, and kept as more arrive (paper §5.3)."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linear_sum_assignment

from cogmap.geometry.arrays import Floats, Indices
from cogmap.services.codelets.sub_maps.config import Config
from cogmap.services.codelets.sub_maps.mixture import (
    SPACING_SQUARES,
    SPACING_SUM,
    SUB_MAP_SD_M,
    Mixture,
    Scene,
    rows_of,
)
from cogmap.services.codelets.sub_maps.neighbourhood import Neighbourhood, Separation
from cogmap.services.codelets.sub_maps.search import (
    compact,
    merge_clusters,
    move_objects,
    partition,
    parts,
)

# A sub-map is parted, or sorted anew with its neighbours, each time that it has grown by a factor;
# more objects than these are sorted anew more seldom, and not parted.
PARTING_GROWTH = 1.25
REVIEW_GROWTH = 1.6
MAX_REVIEWED = 600
RARE_REVIEW_GROWTH = REVIEW_GROWTH**2
MAX_PARTED = 150
# The label of objects that are in no sub-map yet.
NEW = -1


class SubMaps:
    """Objects, and the labels of their sub-maps, (n,), which are kept as long as a sub-map exists.

    Positions are (n, 2); functions (n,), from 0 to `kinds` - 1, or -1 if unknown; `boundaries`
    are what separates objects. A boundary within `clear_m`, (n,), of an object is of the object
    itself and separates nothing. Objects labelled NEW are in none yet.
    """

    def __init__(
        self,
        positions_m: Floats,
        functions: Indices,
        boundaries: Separation,
        config: Config,
        *,
        kinds: int,
        clear_m: Floats | None = None,
        labels: Indices | None = None,
        next_label: int = 0,
    ) -> None:
        count = len(positions_m)
        self.labels = np.full(count, NEW) if labels is None else labels.copy()
        self.next_label = max(next_label, int(self.labels.max(initial=NEW)) + 1)

        self._mixture = Mixture(config)
        self._kinds = kinds
        self._centre_m = positions_m.mean(axis=0) if count else np.zeros(2)

        own_m = np.zeros(count) if clear_m is None else clear_m
        self._near = Neighbourhood(positions_m, own_m, boundaries, SUB_MAP_SD_M)
        self._rows = self._rows_of(positions_m, functions)
        self._set_spacings()

    def settle(self) -> None:
        """Find the most probable partition of all objects, from the labels that they have; those
        that are in no sub-map begin alone.
        """
        start = self.labels.copy()
        is_new = start == NEW
        start[is_new] = self.next_label + np.arange(is_new.sum())

        everyone = np.arange(len(start))
        found = partition(self._mixture, self._scene(everyone), start)
        self._relabel(everyone, found)

    def add(self, position_m: Floats, function: int = -1, clear_m: float = 0.0) -> int:
        """Add an object, at (2,), and return its label. Sub-maps near it may merge, part or
        exchange objects.
        """
        near = self._near.append(position_m, clear_m)
        row = self._rows_of(position_m[None], np.array([function]))
        self._rows = np.vstack([self._rows, row])
        self._set_spacings()
        self.labels = np.append(self.labels, NEW)

        is_member = np.isin(self.labels, np.unique(self.labels[near])) & (self.labels != NEW)
        is_member[-1] = True
        members = np.flatnonzero(is_member)

        scene = self._scene(members)
        labels = self.labels[members]
        labels[-1] = self.next_label
        merged = merge_clusters(self._mixture, scene, compact(labels))
        moved = move_objects(self._mixture, scene, merged)
        self._relabel(members, moved)

        self._follow_growth(int(self.labels[-1]))
        return int(self.labels[-1])

    def _follow_growth(self, label: int) -> None:
        """Sort anew, or part, a sub-map that has grown by its last object: the more seldom the
        larger it is, so that this costs little for each object.
        """
        is_own = self.labels == label
        size = int(is_own.sum())
        if _has_grown(size, REVIEW_GROWTH):
            edges = self._near.edges
            beside = edges[is_own[edges[:, 0]] | is_own[edges[:, 1]]]
            is_around = np.isin(self.labels, np.unique(self.labels[beside])) | is_own
            members = np.flatnonzero(is_around)
            if len(members) <= MAX_REVIEWED or _has_grown(size, RARE_REVIEW_GROWTH):
                found = partition(self._mixture, self._scene(members), self.labels[members])
                self._relabel(members, found)
                return

        if size <= MAX_PARTED and _has_grown(size, PARTING_GROWTH):
            members = np.flatnonzero(is_own)
            self._relabel(members, parts(self._mixture, self._scene(members)))

    def _relabel(self, members: Indices, clusters: Indices) -> None:
        """Give the clusters of some objects, (m,), the labels that they had, if they had any."""
        labels = kept_labels(self.labels[members], clusters, self.next_label)
        self.labels[members] = labels
        self.next_label = max(self.next_label, int(labels.max(initial=NEW)) + 1)

    def _rows_of(self, positions_m: Floats, functions: Indices) -> Floats:
        return rows_of(positions_m - self._centre_m, functions, self._kinds)

    def _set_spacings(self) -> None:
        spacings = self._near.spacings
        self._rows[:, SPACING_SUM] = spacings
        self._rows[:, SPACING_SQUARES] = spacings**2

    def _scene(self, members: Indices) -> Scene:
        """Return what is to be clustered of some objects, (m,)."""
        count = len(self._rows)
        number = np.full(count, -1)
        number[members] = np.arange(len(members))

        is_inside = self._near.inside(number >= 0)
        crossed = self._near.is_crossed[is_inside]
        bonds = self._mixture.bonds(crossed, self._near.gaps(is_inside))
        return Scene(self._rows[members], number[self._near.edges[is_inside]], bonds)


def _has_grown(size: int, growth: float) -> bool:
    """Return whether the last of so many objects completes another growth by a factor, since the
    first.
    """
    if size < 2:
        return False

    step = math.log(growth)
    return math.floor(math.log(size) / step) > math.floor(math.log(size - 1) / step)


def kept_labels(before: Indices, after: Indices, next_label: int) -> Indices:
    """Give the partition `after` the labels of `before`, (n,), which are NEW for objects that had
    none.

    Each cluster keeps the label of the one that it shares most objects with. If several claim one
    label, or several labels are there for one cluster, the most objects in all decide. Clusters
    that are left over get new labels from `next_label`, in the order of their first objects.
    """
    names, number = np.unique(after, return_inverse=True)
    had_label = before != NEW
    old_names, old_number = np.unique(before[had_label], return_inverse=True)

    shared = np.zeros((len(names), len(old_names)))
    np.add.at(shared, (number[had_label], old_number), 1.0)
    clusters, olds = linear_sum_assignment(shared, maximize=True)
    is_shared = shared[clusters, olds] > 0

    labels = np.full(len(names), NEW)
    labels[clusters[is_shared]] = old_names[olds[is_shared]]

    _, first = np.unique(after, return_index=True)
    fresh = np.flatnonzero(labels == NEW)
    fresh = fresh[np.argsort(first[fresh])]
    labels[fresh] = next_label + np.arange(len(fresh))
    kept: Indices = labels[number]
    return kept
