"""Finds the links between neighbouring place nodes that straight lines cross."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices

# The links of one direction lie on the lines where v is an integer, each from an integer u to the
# next. (u, v) is (x, y) for E, (x, y - x) for NE, (y, x) for N and (y, x + y) for NW.
AXIS_U = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
AXIS_V = np.array([[0.0, 1.0], [-1.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
# The cell (i, j) that such a link belongs to: each coordinate as multiples of u and of v.
CELL_I = np.array([[1, 0], [1, 0], [0, 1], [-1, 1]])
CELL_J = np.array([[0, 1], [1, 1], [1, 0], [1, 0]])


class Crossings(NamedTuple):
    """Links that segments cross, (k,) each: the link by its direction, a number of LINK_OFFSETS,
    and the cell (i, j) that it belongs to; and the number of the segment.
    """

    direction: Indices
    i: Indices
    j: Indices
    segment: Indices


def crossings(starts: Floats, ends: Floats) -> Crossings:
    """Return the links that (n, 2) straight segments cross, positions being in cells.

    If one segment follows another, a link is crossed by one of them.
    """
    from_u, from_v = _on_axes(starts)
    to_u, to_v = _on_axes(ends)

    # The lines between both ends of each side: integers v, of which the greater end is left out.
    first = np.ceil(np.minimum(from_v, to_v)).astype(np.int64)
    last = np.ceil(np.maximum(from_v, to_v)).astype(np.int64)
    count = last - first
    side = np.repeat(np.arange(count.size), count)
    before = np.cumsum(count) - count
    v: Indices = first[side] + np.arange(side.size) - before[side]

    share = (v - from_v[side]) / (to_v - from_v)[side]
    u = from_u[side] + share * (to_u - from_u)[side]

    direction, segment = np.divmod(side, max(1, len(starts)))
    along = np.floor(u).astype(np.int64)
    i = CELL_I[direction, 0] * along + CELL_I[direction, 1] * v
    j = CELL_J[direction, 0] * along + CELL_J[direction, 1] * v
    return Crossings(direction, i, j, segment)


def _on_axes(points: Floats) -> tuple[Floats, Floats]:
    """Return u and v of (n, 2) points for each direction, (4 n,) each."""
    u = AXIS_U @ points.T
    v = AXIS_V @ points.T
    return u.reshape(-1), v.reshape(-1)
