"""Objects and their neighbours: how far apart they are, and what is between them."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.sub_maps.neighbours import comes_between, neighbours, neighbours_of

# What a neighbour across a boundary counts for: hardly anything, unless there are no others.
CROSSED_SHARE = 0.01
# In units: of two objects at one place the logarithm stays finite.
MIN_SPACING = 0.01


class Separation(Protocol):
    """Separates objects: boundaries as lines, or links that are cut."""

    def are_crossed(self, lines_m: Floats, clear_m: Floats | None = None) -> Booleans:
        """Decide whether a boundary is across each of (k, 2, 2) lines, (k,), farther than `clear_m`
        from its ends, (k, 2).
        """


class Neighbourhood:
    """Objects at (n, 2) `positions_m`, the pairs of neighbours among them, (e, 2) `edges`, and
    whether a boundary is between these, (e,) `is_crossed`.

    Boundaries within `clear_m`, (n,), of an object are its own. `spacings`, (n,), are logarithms of
    the distance of an object to its neighbours over `unit_m`: of those on the same side of
    boundaries, or of the others if it has none. It is the harmonic mean, on which a neighbour
    far away has little influence.
    """

    def __init__(
        self, positions_m: Floats, clear_m: Floats, boundaries: Separation, unit_m: float
    ) -> None:
        self.positions_m = positions_m
        self._clear_m = clear_m
        self._boundaries = boundaries
        self._unit_m = unit_m

        self.edges = neighbours(positions_m)
        self.is_crossed = self._crossed(self.edges)
        self._distances = self._distances_of(self.edges)
        self.spacings = np.zeros(len(positions_m))
        self._set_spacings(np.ones(len(positions_m), bool))

    def append(self, position_m: Floats, clear_m: float) -> Indices:
        """Add an object, and return which others are its neighbours."""
        near = neighbours_of(self.positions_m, position_m)
        is_parted = comes_between(self.positions_m, self.edges, position_m)
        number = len(self.positions_m)

        is_touched = np.zeros(number + 1, bool)
        is_touched[near] = True
        is_touched[self.edges[is_parted].ravel()] = True
        is_touched[number] = True

        self.positions_m = np.vstack([self.positions_m, position_m])
        self._clear_m = np.append(self._clear_m, clear_m)
        self.spacings = np.append(self.spacings, 0.0)

        edges = np.column_stack([near, np.full(len(near), number)])
        is_left = ~is_parted
        self.edges = np.vstack([self.edges[is_left], edges])
        self.is_crossed = np.append(self.is_crossed[is_left], self._crossed(edges))
        self._distances = np.append(self._distances[is_left], self._distances_of(edges))
        self._set_spacings(is_touched)
        return near

    def inside(self, members: Booleans) -> Booleans:
        """Decide for each pair of neighbours, (e,), whether both are members, (n,)."""
        inside: Booleans = members[self.edges[:, 0]] & members[self.edges[:, 1]]
        return inside

    def gaps(self, chosen: Booleans) -> Floats:
        """Compute the logarithm of how far apart the chosen pairs, (e,), are over the spacing of
        the one that stands more freely, (k,).
        """
        first, second = self.edges[chosen].T
        usual = np.maximum(self.spacings[first], self.spacings[second])
        gaps: Floats = np.log(self._distances[chosen]) - usual
        return gaps

    def _crossed(self, edges: Indices) -> Booleans:
        lines_m = self.positions_m[edges]
        return self._boundaries.are_crossed(lines_m, self._clear_m[edges])

    def _distances_of(self, edges: Indices) -> Floats:
        """Compute how far apart the two of each pair are, over the unit, (e,)."""
        offset_m = self.positions_m[edges[:, 1]] - self.positions_m[edges[:, 0]]
        apart_m = np.hypot(offset_m[:, 0], offset_m[:, 1])
        distances: Floats = np.maximum(apart_m / self._unit_m, MIN_SPACING)
        return distances

    def _set_spacings(self, chosen: Booleans) -> None:
        """Compute the spacings of some objects, (n,), anew."""
        is_near = chosen[self.edges[:, 0]] | chosen[self.edges[:, 1]]
        ends = self.edges[is_near].ravel()
        weights = np.where(self.is_crossed[is_near], CROSSED_SHARE, 1.0)
        closeness = weights / self._distances[is_near]

        count = len(chosen)
        summed = np.bincount(ends, np.repeat(closeness, 2), count)
        counted = np.bincount(ends, np.repeat(weights, 2), count)

        known = np.flatnonzero(chosen & (counted > 0))
        self.spacings[chosen] = 0.0
        self.spacings[known] = np.log(counted[known] / summed[known])
