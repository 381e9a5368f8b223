"""The shortest tour: exact, by dynamic programming over subsets (Held & Karp 1962)."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from cogmap.errors import CogmapError

Matrix = npt.NDArray[np.float64]
# By the set of stops visited and the last of them: the length from 0, and the stop before the last.
Paths = dict[tuple[int, int], tuple[float, int]]


def shortest_tour(distance: Matrix) -> tuple[float, list[int]]:
    """Length and order, beginning with 0, of the shortest closed tour by (n, n) symmetric
    distances, n at most 12.

    Raises CogmapError where some cannot be reached.
    """
    count = len(distance)
    if count < 3:
        length = 2 * float(distance[0, -1]) if count == 2 else 0.0
        return length, list(range(count))

    best = _best_paths(distance)
    visited = (1 << count) - 2
    closed = [(best[visited, k][0] + float(distance[k, 0]), k) for k in range(1, count)]
    length, last = min(closed)

    if not np.isfinite(length):
        raise CogmapError("no tour: some of the buildings cannot be reached from the others")

    return length, _order(best, visited, last)


def _best_paths(distance: Matrix) -> Paths:
    """The shortest path from 0 through each set of stops, for each that may be its last."""
    count = len(distance)
    best: Paths = {(1 << k, k): (float(distance[0, k]), 0) for k in range(1, count)}

    for size in range(2, count):
        for chosen in itertools.combinations(range(1, count), size):
            visited = sum(1 << k for k in chosen)
            for last in chosen:
                rest = visited & ~(1 << last)
                longer = [
                    (best[rest, k][0] + float(distance[k, last]), k) for k in chosen if k != last
                ]
                best[visited, last] = min(longer)

    return best


def _order(best: Paths, visited: int, last: int) -> list[int]:
    """The stops of the best path through `visited` that ends in `last`, from 0 on."""
    order = []

    while last:
        order.append(last)
        _, before = best[visited, last]
        visited &= ~(1 << last)
        last = before

    return [0, *reversed(order)]
