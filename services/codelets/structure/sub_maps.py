"""Objects and the sub-map of each: found for all at once, and kept as more arrive (paper §5.3)."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from services.codelets.structure.config import Config
from services.codelets.structure.crossings import Boundaries
from services.codelets.structure.labels import NEW, kept_labels
from services.codelets.structure.mixture import (
    SPACING_SQUARES,
    SPACING_SUM,
    Mixture,
    Scene,
    rows_of,
)
from services.codelets.structure.neighbours import comes_between, neighbours, neighbours_of
from services.codelets.structure.search import merge_clusters, move_objects, partition, parts

PARTING_GROWTH = 1.2
CROSSED_SHARE = 0.01
MIN_SPACING = 0.01


class SubMaps:
    """Objects, and the labels of their sub-maps, (n,), which are kept as long as a sub-map exists.

    Positions are (n, 2); functions (n,), from 0 to `kinds` - 1, or -1 where unknown; `boundaries`
    are what separates objects. A boundary within `clear_m`, (n,), of an object is of the object
    itself and separates nothing. Objects labelled NEW are in none yet.
    """

    def __init__(
        self,
        positions_m: Floats,
        functions: Indices,
        boundaries: Boundaries,
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
        self._boundaries = boundaries
        self._kinds = kinds
        self._reference_m = config.sub_map_sd_m
        self._centre_m = positions_m.mean(axis=0) if count else np.zeros(2)

        self._positions_m = positions_m - self._centre_m
        self._functions = functions
        self._clear_m = np.zeros(count) if clear_m is None else clear_m
        self._edges = neighbours(self._positions_m)
        self._is_crossed = self._crossed(self._edges)
        self._rows = rows_of(self._positions_m, self._spacings(), functions, kinds)

    def settle(self) -> None:
        """Find the most probable partition of all objects, from the labels that they have; those
        that are in no sub-map begin alone.
        """
        start = self.labels.copy()
        is_new = start == NEW
        start[is_new] = self.next_label + np.arange(is_new.sum())

        found = partition(self._mixture, self._scene(), start)
        self._relabel(np.arange(len(found)), found)

    def add(self, position_m: Floats, function: int = -1, clear_m: float = 0.0) -> int:
        """The label of one more object, at (2,). Sub-maps near it may merge, part or exchange
        objects.
        """
        near = self._append(position_m - self._centre_m, function, clear_m)
        touched = np.unique(self.labels[near])
        members = np.flatnonzero(np.isin(self.labels, touched))
        members = np.append(members[self.labels[members] != NEW], len(self.labels) - 1)

        scene = self._scene().part(members)
        labels = self.labels[members]
        labels[-1] = self.next_label
        merged = merge_clusters(self._mixture, scene, np.unique(labels, return_inverse=True)[1])
        moved = move_objects(self._mixture, scene, merged)
        self._relabel(members, moved)

        label = int(self.labels[-1])
        self._part_if_grown(label)
        return int(self.labels[-1])

    def _part_if_grown(self, label: int) -> None:
        """Part a sub-map in two where that is more probable; asked at every growth by a share, so
        that it costs little for each object.
        """
        members = np.flatnonzero(self.labels == label)
        step = math.log(PARTING_GROWTH)
        stage = math.floor(math.log(len(members)) / step)
        before = math.floor(math.log(max(1, len(members) - 1)) / step)
        if stage > before:
            is_second = parts(self._mixture, self._scene().part(members))
            self._relabel(members, is_second.astype(np.int64))

    def _relabel(self, members: Indices, partition: Indices) -> None:
        """Give the clusters of some objects, (m,), the labels that they had, where they had any."""
        labels = kept_labels(self.labels[members], partition, self.next_label)
        self.labels[members] = labels
        self.next_label = max(self.next_label, int(labels.max(initial=NEW)) + 1)

    def _append(self, position_m: Floats, function: int, clear_m: float) -> Indices:
        """Add an object that is in no sub-map; its neighbours."""
        near = neighbours_of(self._positions_m, position_m)
        is_parted = comes_between(self._positions_m, self._edges, position_m)
        number = len(self._positions_m)

        self._positions_m = np.vstack([self._positions_m, position_m])
        self._functions = np.append(self._functions, function)
        self._clear_m = np.append(self._clear_m, clear_m)
        self.labels = np.append(self.labels, NEW)

        edges = np.column_stack([near, np.full(len(near), number)])
        is_crossed = self._crossed(edges)
        self._edges = np.vstack([self._edges[~is_parted], edges])
        self._is_crossed = np.append(self._is_crossed[~is_parted], is_crossed)

        row = rows_of(position_m[None], np.zeros(1), self._functions[-1:], self._kinds)
        self._rows = np.vstack([self._rows, row])
        spacings = self._spacings()
        self._rows[:, SPACING_SUM] = spacings
        self._rows[:, SPACING_SQUARES] = spacings**2
        return near

    def _scene(self) -> Scene:
        """What is to be clustered, as it is now."""
        spacings = self._rows[:, SPACING_SUM]
        usual = spacings[self._edges].max(axis=1)
        bonds = self._mixture.bonds(self._is_crossed, np.log(self._distances()) - usual)
        return Scene(self._rows, self._edges, bonds)

    def _crossed(self, edges: Indices) -> Booleans:
        """(e,): whether a boundary is between two objects, (e, 2)."""
        lines_m = self._positions_m[edges] + self._centre_m
        return self._boundaries.are_crossed(lines_m, self._clear_m[edges])

    def _spacings(self) -> Floats:
        """(n,): the logarithm of the distance of each object to its neighbours on the same side of
        boundaries, or to the others where it has none, as a share of a sub-map's extent.

        It is the harmonic mean, on which a neighbour far away has little influence.
        """
        closeness = 1 / self._distances()
        weights = np.where(self._is_crossed, CROSSED_SHARE, 1.0)

        ends = self._edges.ravel()
        count = len(self._positions_m)
        summed = np.bincount(ends, np.repeat(weights * closeness, 2), count)
        counted = np.bincount(ends, np.repeat(weights, 2), count)

        spacings = np.zeros(count)
        has_any = counted > 0
        spacings[has_any] = np.log(counted[has_any] / summed[has_any])
        return spacings

    def _distances(self) -> Floats:
        """(e,): how far apart neighbours are, as a share of a sub-map's extent."""
        first, second = self._positions_m[self._edges].transpose(1, 0, 2)
        apart_m = np.hypot(*(second - first).T)
        distances: Floats = np.maximum(apart_m / self._reference_m, MIN_SPACING)
        return distances
