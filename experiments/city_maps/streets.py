"""A street network: points, and straight pieces between them. Where it is nearest to something, and
the ways on it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
_CHUNK = 256


@dataclass(frozen=True, eq=False)
class Streets:
    """`points_m` (n, 2), `pieces` (m, 2): the points that each piece joins."""

    points_m: Points
    pieces: Indices

    @property
    def length_m(self) -> float:
        """Of all pieces together."""
        return float(self._lengths_m().sum())

    def connected(self) -> Streets:
        """The part with the most points from where each can be reached from every other, and no
        others.
        """
        _, part = connected_components(self._graph(), directed=False)
        kept = np.flatnonzero(part == np.bincount(part).argmax())
        number = np.full(len(self.points_m), -1)
        number[kept] = np.arange(len(kept))
        pieces = number[self.pieces]
        return Streets(self.points_m[kept], pieces[(pieces >= 0).all(axis=1)])

    def nearest(self, positions_m: Points) -> tuple[Indices, Points]:
        """The piece nearest to each of (k, 2) positions, and the nearest point on it, (k, 2)."""
        start = self.points_m[self.pieces[:, 0]]
        along = self.points_m[self.pieces[:, 1]] - start
        squared = np.maximum((along**2).sum(1), 1e-9)
        found = []
        feet = []
        for position in np.array_split(positions_m, range(_CHUNK, len(positions_m), _CHUNK)):
            share = (((position[:, None] - start) * along).sum(2) / squared).clip(0, 1)
            foot = start + share[..., None] * along
            best = ((position[:, None] - foot) ** 2).sum(2).argmin(1)
            found.append(best)
            feet.append(foot[np.arange(len(position)), best])
        return np.concatenate(found), np.concatenate(feet)

    def with_points(self, positions_m: Points) -> tuple[Streets, Indices]:
        """The network with a point of its own where each of (k, 2) positions is nearest to it;
        those points' numbers.

        The pieces that are cut are replaced.
        """
        found, feet = self.nearest(positions_m)
        numbers = len(self.points_m) + np.arange(len(feet))
        points = np.vstack([self.points_m, feet])
        pieces = [
            piece
            for place, piece in enumerate(self.pieces.tolist())
            if place not in set(found.tolist())
        ]
        for place in np.unique(found).tolist():
            a, b = self.pieces[place].tolist()
            on_it = numbers[found == place]
            away = np.hypot(*(points[on_it] - points[a]).T)
            chain = [a, *on_it[np.argsort(away, kind="stable")].tolist(), b]
            pieces.extend(list(pair) for pair in itertools.pairwise(chain))
        return Streets(points, np.array(pieces, np.intp)), numbers

    def ways(self, from_points: Indices) -> tuple[Points, Indices]:
        """Distances along the streets from each of k points to all, (k, n), infinite where there is
        no way, and the point before each on the shortest way, (k, n).
        """
        distance, before = dijkstra(
            self._graph(), directed=False, indices=from_points, return_predecessors=True
        )
        return distance, before

    def _lengths_m(self) -> Points:
        along = self.points_m[self.pieces[:, 1]] - self.points_m[self.pieces[:, 0]]
        return np.asarray(np.hypot(along[:, 0], along[:, 1]))

    def _graph(self) -> csr_array:
        # An explicit zero would be no edge at all; of two pieces between the same points the sum
        # would be taken.
        ends = np.sort(self.pieces, axis=1)
        ends, first = np.unique(ends, axis=0, return_index=True)
        weights = np.maximum(self._lengths_m()[first], 1e-6)
        return coo_array((weights, ends.T), shape=(len(self.points_m),) * 2).tocsr()


def backwards(before: Indices, end: int) -> list[int]:
    """The points of the shortest way to `end`, by a row of `Streets.ways`."""
    way = [end]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return way[::-1]
