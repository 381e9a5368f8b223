"""A street network of straight pieces between points, and the shortest paths on it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from cogmap.geometry.polylines import nearest_on_pieces

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
MIN_LENGTH_M = 1e-6
# A city has many pieces: their distances to many positions at once would not fit into memory.
_CHUNK = 256


@dataclass(frozen=True, eq=False)
class Streets:
    """`points_m` (n, 2), `pieces` (m, 2): the points that each piece joins."""

    points_m: Points
    pieces: Indices

    @property
    def length_m(self) -> float:
        """Return the length of all pieces together."""
        lengths_m = self._lengths_m()
        return float(lengths_m.sum())

    def connected(self) -> Streets:
        """Return the largest part in which each point can be reached from every other."""
        _, part = connected_components(self._graph(), directed=False)
        largest = np.bincount(part).argmax()
        is_kept = part == largest

        starts, _ = self.pieces.T
        pieces = self.pieces[is_kept[starts]]
        numbers = np.cumsum(is_kept) - 1
        return Streets(self.points_m[is_kept], numbers[pieces])

    def nearest(self, positions_m: Points) -> tuple[Indices, Points]:
        """Return the piece nearest to each of (k, 2) positions, and the nearest point on it, (k,
        2).
        """
        starts_m, ends_m = self._ends_m()
        pieces = []
        feet_m = []

        for chunk_m in np.array_split(positions_m, range(_CHUNK, len(positions_m), _CHUNK)):
            found = nearest_on_pieces(starts_m, ends_m, chunk_m)
            pieces.append(found.piece)
            feet_m.append(found.foot_m)

        return np.concatenate(pieces), np.concatenate(feet_m)

    def with_points(self, positions_m: Points) -> tuple[Streets, Indices]:
        """Return the network with a point of its own where each of (k, 2) positions is nearest to
        it.

        Returns those points' numbers too. The pieces that are cut are replaced.
        """
        cut, feet_m = self.nearest(positions_m)
        points_m = np.vstack([self.points_m, feet_m])
        numbers = len(self.points_m) + np.arange(len(feet_m))

        is_whole = np.ones(len(self.pieces), bool)
        is_whole[cut] = False
        pieces: list[Sequence[int]] = self.pieces[is_whole].tolist()

        for piece in np.unique(cut).tolist():
            start, end = self.pieces[piece].tolist()
            on_it = numbers[cut == piece]
            distances_m = np.hypot(*(points_m[on_it] - points_m[start]).T)
            between = on_it[np.argsort(distances_m, kind="stable")].tolist()
            pieces += itertools.pairwise([start, *between, end])

        return Streets(points_m, np.array(pieces, np.intp)), numbers

    def shortest_paths(self, from_points: Indices) -> tuple[Points, Indices]:
        """Return distances along the streets from each of k points to all, (k, n), infinite if
        there is no path, and the point before each on the shortest path, (k, n).
        """
        distances_m, before = dijkstra(
            self._graph(), directed=False, indices=from_points, return_predecessors=True
        )
        return distances_m, before

    def _ends_m(self) -> tuple[Points, Points]:
        """Return where the pieces start, and where they end, (m, 2) each."""
        starts, ends = self.pieces.T
        return self.points_m[starts], self.points_m[ends]

    def _lengths_m(self) -> Points:
        """Return the length of each piece, (m,)."""
        starts_m, ends_m = self._ends_m()
        offsets_m = ends_m - starts_m
        return np.asarray(np.hypot(*offsets_m.T))

    def _graph(self) -> csr_array:
        # An explicit zero would be no edge at all; of two pieces between the same points the sum
        # would be taken.
        undirected = np.sort(self.pieces, axis=1)
        ends, first = np.unique(undirected, axis=0, return_index=True)
        lengths_m = self._lengths_m()
        weights = np.maximum(lengths_m[first], MIN_LENGTH_M)

        count = len(self.points_m)
        shape = (count, count)
        graph = coo_array((weights, ends.T), shape=shape)
        return graph.tocsr()


def shortest_path(before: Indices, end: int) -> list[int]:
    """Return the points of the shortest path to `end`, by a row of `Streets.shortest_paths`."""
    path = []
    point = end

    while point >= 0:
        path.append(point)
        point = int(before[point])

    return path[::-1]
