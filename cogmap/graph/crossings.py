"""Which links between neighbouring place nodes a straight line crosses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices

# The links of one direction lie on the lines where v is an integer, each from an integer u to the
# next. (u, v) is (x, y) for E, (x, y - x) for NE, (y, x) for N and (y, x + y) for NW.
_U = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
_V = np.array([[0.0, 1.0], [-1.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
# The cell (i, j) that such a link belongs to: each coordinate as multiples of u and of v.
_I = np.array([[1, 0], [1, 0], [0, 1], [-1, 1]])
_J = np.array([[0, 1], [1, 1], [1, 0], [1, 0]])


class Crossings(NamedTuple):
    """Links that segments cross, (k,) each: the link by its direction, a number of LINK_OFFSETS,
    and the cell (i, j) that it belongs to; and the number of the segment.
    """

    direction: Indices
    i: Indices
    j: Indices
    segment: Indices


def crossings(starts: Floats, ends: Floats) -> Crossings:
    """The links that (n, 2) straight segments cross, positions being in cells.

    Where one segment follows another, a link is crossed by one of them.
    """
    from_u, from_v = _on_axes(starts)
    to_u, to_v = _on_axes(ends)
    side, v = _lines_between(from_v, to_v)

    rise = (to_v - from_v)[side]
    share = (v - from_v[side]) / rise
    u = from_u[side] + share * (to_u - from_u)[side]

    direction, segment = np.divmod(side, max(1, len(starts)))
    i, j = _cells(direction, u, v)
    return Crossings(direction, i, j, segment)


def _lines_between(starts: Floats, ends: Floats) -> tuple[Indices, Indices]:
    """The integers in n intervals, of which the greater end is left out: the number of the
    interval, (k,), and the integer, (k,).
    """
    lower = np.minimum(starts, ends)
    upper = np.maximum(starts, ends)
    first = np.ceil(lower).astype(np.int64)
    last = np.ceil(upper).astype(np.int64)

    count = last - first
    interval = np.repeat(np.arange(count.size), count)
    before = np.cumsum(count) - count
    place = np.arange(interval.size) - before[interval]

    integers: Indices = first[interval] + place
    return interval, integers


def _cells(direction: Indices, u: Floats, v: Indices) -> tuple[Indices, Indices]:
    """The cells (i, j) that the links at (k,) `u` on the lines `v` belong to."""
    along = np.floor(u).astype(np.int64)
    i = _I[direction, 0] * along + _I[direction, 1] * v
    j = _J[direction, 0] * along + _J[direction, 1] * v
    return i, j


def _on_axes(points: Floats) -> tuple[Floats, Floats]:
    """u and v of (n, 2) points for each direction, (4 n,) each."""
    u = _U @ points.T
    v = _V @ points.T
    return u.reshape(-1), v.reshape(-1)
