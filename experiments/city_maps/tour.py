"""The shortest tour: exact, by dynamic programming over subsets (Held & Karp 1962)."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from cogmap.errors import CogmapError

Matrix = npt.NDArray[np.float64]


def shortest_tour(distance: Matrix) -> tuple[float, list[int]]:
    """Length and order, beginning with 0, of the shortest closed tour by (n, n) symmetric
    distances, n at most 12.

    Raises CogmapError where some cannot be reached.
    """
    n = len(distance)
    if n < 3:
        return float(distance[0, -1] * 2 if n == 2 else 0.0), list(range(n))
    best: dict[tuple[int, int], tuple[float, int]] = {
        (1 << k, k): (float(distance[0, k]), 0) for k in range(1, n)
    }
    for size in range(2, n):
        for chosen in itertools.combinations(range(1, n), size):
            mask = sum(1 << k for k in chosen)
            for last in chosen:
                rest = mask & ~(1 << last)
                best[mask, last] = min(
                    (best[rest, k][0] + float(distance[k, last]), k) for k in chosen if k != last
                )
    mask = (1 << n) - 2
    length, last = min((best[mask, k][0] + float(distance[k, 0]), k) for k in range(1, n))
    if not np.isfinite(length):
        raise CogmapError("no tour: some of the buildings cannot be reached from the others")
    order = []
    while last:
        order.append(last)
        mask, last = mask & ~(1 << last), best[mask, last][1]
    return length, [0, *reversed(order)]
