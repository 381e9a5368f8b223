"""The shortest tour: exact, by dynamic programming over subsets (Held & Karp 1962)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from cogmap.errors import CogmapError

Matrix = npt.NDArray[np.float64]
# By the set of stops visited and the last of them: the length from 0, and the stop before the last.
Paths = dict[tuple[int, int], tuple[float, int]]


def shortest_tour(distance: Matrix) -> tuple[float, list[int]]:
    """Find length and order, beginning with 0, of the shortest closed tour by (n, n) symmetric
    distances, n at most 12.

    Raises CogmapError if some cannot be reached.
    """
    count = len(distance)
    if count < 2:
        return 0.0, list(range(count))

    best = _best_paths(distance)
    stops = range(1, count)
    length, last = _extended(best, stops, distance[:, 0])

    if not np.isfinite(length):
        raise CogmapError("no tour: some of the buildings cannot be reached from the others")

    visited = _set_of(stops)
    order = []
    while last:
        order.append(last)
        _, before = best[visited, last]
        visited &= ~(1 << last)
        last = before

    return length, [0, *reversed(order)]


def _best_paths(distance: Matrix) -> Paths:
    """Return the shortest path from 0 through each set of stops, for each that may be its last."""
    stops = range(1, len(distance))
    best: Paths = {}

    for stop in stops:
        length = float(distance[0, stop])
        best[_set_of([stop]), stop] = (length, 0)

    for size in range(2, len(distance)):
        for chosen in itertools.combinations(stops, size):
            for last in chosen:
                others = [stop for stop in chosen if stop != last]
                best[_set_of(chosen), last] = _extended(best, others, distance[:, last])

    return best


def _extended(best: Paths, visited: Sequence[int], onward: Matrix) -> tuple[float, int]:
    """Return the shortest path through the stops `visited` and on to one more, `onward` (n,) from
    each: its length, and the stop before the last.
    """
    paths = []

    for before in visited:
        length, _ = best[_set_of(visited), before]
        paths.append((length + float(onward[before]), before))

    return min(paths)


def _set_of(stops: Iterable[int]) -> int:
    """Return a set of stops, a bit each."""
    return sum(1 << stop for stop in stops)
