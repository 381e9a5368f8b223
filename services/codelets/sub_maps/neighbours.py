"""Which objects are neighbours: the Gabriel graph. Two are if no other lies inside the circle
over the line between them.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Booleans, Floats, Indices

NEAREST = 20
"""Among so many nearest objects neighbours are sought; hardly any has one that is farther."""
# Objects at a time: their products of NEAREST x NEAREST take 7 MB.
CHUNK = 2048
# A share of the squared distance, more than rounding errors: an object on the circle is not inside.
ROUNDING = 1e-9


def neighbours(positions_m: Floats) -> Indices:
    """Find (e, 2) pairs of neighbours among (n, 2) positions, each once, the lower index first."""
    count = len(positions_m)
    nearest = min(NEAREST, count - 1)
    if nearest < 1:
        return np.zeros((0, 2), np.int64)

    tree = cKDTree(positions_m)
    pairs = []
    for start in range(0, count, CHUNK):
        rows = np.arange(start, min(start + CHUNK, count))
        _, found = tree.query(positions_m[rows], nearest + 1)

        # Each row's nearest without the object itself; if others at the same place have displaced
        # it, without the last.
        is_other = found != rows[:, None]
        is_other[is_other.all(axis=1), -1] = False
        near = found[is_other].reshape(len(rows), -1)
        is_neighbour = _is_neighbour(positions_m[near] - positions_m[rows, None])
        row, column = np.nonzero(is_neighbour)
        pairs.append(np.column_stack([rows[row], near[row, column]]))

    both = np.sort(np.concatenate(pairs), axis=1)
    return np.unique(both, axis=0)


def neighbours_of(positions_m: Floats, point_m: Floats) -> Indices:
    """Find which of (n, 2) positions are neighbours of a point (2,) that is none of them, (k,)."""
    offsets_m = positions_m - point_m
    distance2 = (offsets_m**2).sum(axis=1)
    nearest = min(NEAREST, len(distance2))
    if not nearest:
        return np.zeros(0, np.int64)

    if nearest < len(distance2):
        near = np.argpartition(distance2, nearest - 1)[:nearest]
    else:
        near = np.arange(nearest)

    near = np.sort(near)
    is_neighbour = _is_neighbour(offsets_m[None, near])[0]
    found: Indices = near[is_neighbour]
    return found


def comes_between(positions_m: Floats, edges: Indices, point_m: Floats) -> Booleans:
    """Decide for each pair of neighbours, (e, 2), whether a new point parts them, (e,)."""
    x_m, y_m = (positions_m - point_m).T.copy()
    first, second = edges.T
    dots = x_m[first] * x_m[second] + y_m[first] * y_m[second]
    parted: Booleans = dots < 0
    return parted


def _is_neighbour(offsets_m: Floats) -> Booleans:
    """Decide, (k, c), which of c objects, at (k, c, 2) from each of k, no other parts from it."""
    squared = (offsets_m**2).sum(axis=2)
    products = offsets_m @ offsets_m.transpose(0, 2, 1)

    # Inside the circle over p, the origin, and q is each r with (r - p)(r - q) = |r|^2 - r q < 0.
    is_inside = squared[:, None, :] * (1 + ROUNDING) < products
    parted: Booleans = ~is_inside.any(axis=2)
    return parted
