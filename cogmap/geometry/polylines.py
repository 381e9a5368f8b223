"""Polylines: (n, 2) points in the plane, joined by straight pieces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import cumulative

CHUNK = 4096


class Nearest(NamedTuple):
    """Of k points: the piece nearest to each, (k,), and the point of it that is nearest, (k, 2)."""

    piece: Indices
    foot_m: Floats


def distances_along(points_m: Floats) -> Floats:
    """Measure how far along a polyline each of its points is, (n,), in metres."""
    if not len(points_m):
        return np.zeros(0)

    lengths_m = np.hypot(*np.diff(points_m, axis=0).T)
    return cumulative(lengths_m)


def points_at(points_m: Floats, along_m: Floats) -> Floats:
    """Return the points (k, 2) of a polyline at distances along it; beyond its ends, the ends."""
    known_m = distances_along(points_m)
    return interpolate(known_m, points_m, along_m)


def interpolate(known: Floats, values: Floats, at: Floats) -> Floats:
    """Interpolate (n, d) `values`, known at increasing `known` (n,), at `at` (k,): (k, d)."""
    columns = [np.interp(at, known, column) for column in values.T]
    return np.column_stack(columns)


def resample(points_m: Floats, spacing_m: float) -> Floats:
    """Return the same polyline with a point every `spacing_m` from its first, (k, 2). Its last
    point is left out unless it is due.
    """
    length_m = distances_along(points_m)[-1]
    return points_at(points_m, np.arange(0.0, length_m, spacing_m))


def nearest_on_line(line_m: Floats, points_m: Floats) -> Nearest:
    """Return the nearest of a polyline to each of (k, 2) points."""
    return nearest_on_pieces(line_m[:-1], line_m[1:], points_m)


class RayCrossings(NamedTuple):
    """Where each of k rays crosses each of m straight pieces, (k, m): `range_m` along the ray,
    infinity where it does not, and at which `share` of the piece.
    """

    range_m: Floats
    share: Floats


def crossings_of(
    starts_m: Floats, ends_m: Floats, from_m: Floats, directions_rad: Floats
) -> RayCrossings:
    """Return where rays from the point `from_m` (2,) in each of (k,) directions cross straight
    pieces, from (m, 2) `starts_m` to `ends_m`.
    """
    along = np.column_stack([np.cos(directions_rad), np.sin(directions_rad)])
    pieces_m = ends_m - starts_m
    offset_m = starts_m - from_m

    cross_m = along[:, :1] * pieces_m[:, 1] - along[:, 1:] * pieces_m[:, 0]
    reach = offset_m[:, 0] * pieces_m[:, 1] - offset_m[:, 1] * pieces_m[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        range_m = reach / cross_m
        share = (along[:, 1:] * offset_m[:, 0] - along[:, :1] * offset_m[:, 1]) / cross_m

    is_crossed = (range_m > 0) & (share >= 0) & (share <= 1)
    return RayCrossings(np.where(is_crossed, range_m, np.inf), np.where(is_crossed, share, 0.0))


def nearest_on_pieces(starts_m: Floats, ends_m: Floats, points_m: Floats) -> Nearest:
    """Return the nearest of m straight pieces, from (m, 2) `starts_m` to `ends_m`, to each of (k,
    2) points.
    """
    found = [
        _nearest(starts_m, ends_m, points_m[start : start + CHUNK])
        for start in range(0, max(1, len(points_m)), CHUNK)
    ]
    pieces, feet_m = zip(*found, strict=True)
    return Nearest(np.concatenate(pieces), np.concatenate(feet_m))


def _nearest(starts_m: Floats, ends_m: Floats, points_m: Floats) -> Nearest:
    along = ends_m - starts_m
    squared_m2 = np.maximum((along**2).sum(axis=1), 1e-9)

    dots = ((points_m[:, None] - starts_m) * along).sum(axis=2)
    share = (dots / squared_m2).clip(0.0, 1.0)
    feet_m = starts_m + share[..., None] * along

    away_m2 = ((points_m[:, None] - feet_m) ** 2).sum(axis=2)
    nearest = away_m2.argmin(axis=1)
    return Nearest(nearest, feet_m[np.arange(len(points_m)), nearest])
