"""Which lines between neighbouring objects cross a boundary."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from cogmap.geometry.arrays import Booleans, Floats

MAX_PIECES = 4096


class Boundaries:
    """Boundaries as (m, 2, 2) straight segments, found by where they are.

    Long segments are kept in pieces, so that a search by distance finds few in vain.
    """

    def __init__(self, segments_m: Floats) -> None:
        self._pieces_m = _pieces(segments_m)
        lengths_m = _lengths_m(self._pieces_m)
        self._reach_m = float(lengths_m.max(initial=0.0)) / 2
        self._tree = cKDTree(self._pieces_m.mean(axis=1)) if len(self._pieces_m) else None

    def are_crossed(self, lines_m: Floats, clear_m: Floats | None = None) -> Booleans:
        """Decide whether each of (k, 2, 2) lines crosses a boundary, (k,).

        Crossings within `clear_m` of its ends, (k, 2), do not count: they are of what stands there.
        """
        is_crossed = np.zeros(len(lines_m), bool)
        if self._tree is None or not len(lines_m):
            return is_crossed

        reach_m = _lengths_m(lines_m) / 2 + self._reach_m + 1e-9
        near = self._tree.query_ball_point(lines_m.mean(axis=1), reach_m)
        counts = np.fromiter(map(len, near), np.int64, len(near))
        line = np.repeat(np.arange(len(near)), counts)
        piece = np.fromiter((each for found in near for each in found), np.int64, counts.sum())

        share = _shares_along(lines_m[line], self._pieces_m[piece])
        counts_here = np.isfinite(share)
        if clear_m is not None:
            length_m = _lengths_m(lines_m)[line]
            along_m = np.nan_to_num(share) * length_m
            counts_here &= along_m > clear_m[line, 0]
            counts_here &= length_m - along_m > clear_m[line, 1]

        is_crossed[line[counts_here]] = True
        return is_crossed


def _lengths_m(lines_m: Floats) -> Floats:
    """Compute the lengths (k,) of (k, 2, 2) lines."""
    along_m = lines_m[:, 1] - lines_m[:, 0]
    return np.hypot(along_m[:, 0], along_m[:, 1])


def _pieces(segments_m: Floats) -> Floats:
    """Return the same segments, in pieces of at most twice their median length; in fewer if those
    would be too many.
    """
    if not len(segments_m):
        return segments_m

    lengths_m = _lengths_m(segments_m)
    total_m = float(lengths_m.sum())
    longest_m = max(2 * float(np.median(lengths_m)), total_m / MAX_PIECES, 1e-6)
    counts = np.ceil(lengths_m / longest_m).astype(np.int64).clip(1)

    segment = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)
    along_m = segments_m[segment, 1] - segments_m[segment, 0]
    from_share = (number / counts[segment])[:, None]
    to_share = ((number + 1) / counts[segment])[:, None]

    starts_m = segments_m[segment, 0] + from_share * along_m
    ends_m = segments_m[segment, 0] + to_share * along_m
    return np.stack([starts_m, ends_m], axis=1)


def _shares_along(lines_m: Floats, others_m: Floats) -> Floats:
    """Return how far along each of (k, 2, 2) lines the other of its pair crosses it, (k,), 0 to 1;
    nan if it does not.
    """
    along_m = lines_m[:, 1] - lines_m[:, 0]
    other_m = others_m[:, 1] - others_m[:, 0]
    apart_m = others_m[:, 0] - lines_m[:, 0]

    area = _cross(along_m, other_m)
    is_parallel = np.abs(area) < 1e-12
    area = np.where(is_parallel, 1.0, area)
    share = _cross(apart_m, other_m) / area
    other_share = _cross(apart_m, along_m) / area

    meets = (share >= 0) & (share <= 1) & (other_share >= 0) & (other_share <= 1)
    shares: Floats = np.where(meets & ~is_parallel, share, np.nan)
    return shares


def _cross(a: Floats, b: Floats) -> Floats:
    """Compute the cross products (k,) of (k, 2) vectors."""
    area: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area
