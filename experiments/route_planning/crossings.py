"""Tours whose legs do not cross, as people's seldom do (van Rooij, Stege and Schactman 2003)."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices


def uncrossed(tour: Indices, positions: Floats) -> Indices:
    """Return a closed tour (n,) past (n, 2) positions without legs that cross: the part between two
    that do is reversed, which is always shorter, until none are left.
    """
    found = tour.copy()
    while True:
        crossing = _crossing(positions[found])
        if not crossing.any():
            return found

        first, last = np.unravel_index(crossing.argmax(), crossing.shape)
        part = slice(first + 1, last + 1)
        found[part] = found[part][::-1].copy()


def _crossing(stops: Floats) -> Booleans:
    """Return which legs of a closed route past (n, 2) stops cross, (n, n), the first one earlier.

    Legs that share a stop, or touch, do not.
    """
    ends = np.roll(stops, -1, axis=0)
    of_starts = _sides(stops, ends, stops)
    of_ends = _sides(stops, ends, ends)
    is_parted = of_starts * of_ends < 0
    return np.asarray(np.triu(is_parted & is_parted.T, 1))


def _sides(starts: Floats, ends: Floats, points: Floats) -> Floats:
    """Return on which side of each of n legs each of k points lies, (n, k): -1, 0 or 1."""
    along = (ends - starts)[:, None]
    offsets = points[None] - starts[:, None]
    return np.sign(along[..., 0] * offsets[..., 1] - along[..., 1] * offsets[..., 0])
