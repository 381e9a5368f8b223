"""A street network of straight pieces between points, and the shortest paths on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
MIN_LENGTH_M = 1e-6
MIN_SQUARED_M2 = 1e-9
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
        """The largest part in which each point can be reached from every other."""
        _, part = connected_components(self._graph(), directed=False)
        largest = np.bincount(part).argmax()
        kept = np.flatnonzero(part == largest)

        number = np.full(len(self.points_m), -1)
        number[kept] = np.arange(len(kept))
        pieces = number[self.pieces]
        is_kept = (pieces >= 0).all(axis=1)
        return Streets(self.points_m[kept], pieces[is_kept])

    def nearest(self, positions_m: Points) -> tuple[Indices, Points]:
        """The piece nearest to each of (k, 2) positions, and the nearest point on it, (k, 2)."""
        pieces = []
        feet_m = []

        for chunk_m in np.array_split(positions_m, range(_CHUNK, len(positions_m), _CHUNK)):
            found, foot_m = self._nearest(chunk_m)
            pieces.append(found)
            feet_m.append(foot_m)

        return np.concatenate(pieces), np.concatenate(feet_m)

    def with_points(self, positions_m: Points) -> tuple[Streets, Indices]:
        """The network with a point of its own where each of (k, 2) positions is nearest to it.

        Returns those points' numbers too. The pieces that are cut are replaced.
        """
        cut, feet_m = self.nearest(positions_m)
        numbers = len(self.points_m) + np.arange(len(feet_m))
        points_m = np.vstack([self.points_m, feet_m])
        is_whole = ~np.isin(np.arange(len(self.pieces)), cut)
        pieces = self.pieces[is_whole].tolist()

        for piece in np.unique(cut).tolist():
            start, end = self.pieces[piece].tolist()
            on_it = numbers[cut == piece]
            offsets_m = points_m[on_it] - points_m[start]
            order = np.argsort(np.hypot(*offsets_m.T), kind="stable")
            chain = [start, *on_it[order].tolist(), end]
            pieces += [list(pair) for pair in itertools.pairwise(chain)]

        return Streets(points_m, np.array(pieces, np.intp)), numbers

    def shortest_paths(self, from_points: Indices) -> tuple[Points, Indices]:
        """Distances along the streets from each of k points to all, (k, n), infinite where there is
        no path, and the point before each on the shortest path, (k, n).
        """
        distances_m, before = dijkstra(
            self._graph(), directed=False, indices=from_points, return_predecessors=True
        )
        return distances_m, before

    def _nearest(self, positions_m: Points) -> tuple[Indices, Points]:
        start_m = self.points_m[self.pieces[:, 0]]
        along_m = self.points_m[self.pieces[:, 1]] - start_m
        squared_m2 = np.maximum((along_m**2).sum(axis=1), MIN_SQUARED_M2)

        offsets_m = positions_m[:, None] - start_m
        share = (offsets_m * along_m).sum(axis=2) / squared_m2
        feet_m = start_m + share.clip(0, 1)[..., None] * along_m

        missing_m = positions_m[:, None] - feet_m
        best = (missing_m**2).sum(axis=2).argmin(axis=1)
        return best, feet_m[np.arange(len(positions_m)), best]

    def _lengths_m(self) -> Points:
        start_m = self.points_m[self.pieces[:, 0]]
        end_m = self.points_m[self.pieces[:, 1]]
        along_m = end_m - start_m
        return np.asarray(np.hypot(along_m[:, 0], along_m[:, 1]))

    def _graph(self) -> csr_array:
        # An explicit zero would be no edge at all; of two pieces between the same points the sum
        # would be taken.
        ends = np.sort(self.pieces, axis=1)
        ends, first = np.unique(ends, axis=0, return_index=True)
        weights = np.maximum(self._lengths_m()[first], MIN_LENGTH_M)
        count = len(self.points_m)
        return coo_array((weights, ends.T), shape=(count, count)).tocsr()


def shortest_path(before: Indices, end: int) -> list[int]:
    """The points of the shortest path to `end`, by a row of `Streets.shortest_paths`."""
    path = [end]

    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))

    return path[::-1]
