"""Convex hulls of points in the plane."""

from __future__ import annotations

from scipy.spatial import ConvexHull, QhullError

from cogmap.geometry.arrays import Floats

MIN_CORNERS = 3


def hull_m(points_m: Floats) -> Floats | None:
    """Return the corners of the convex hull of (n, 2) points, counter-clockwise; None if they span
    no area.
    """
    if len(points_m) < MIN_CORNERS:
        return None

    try:
        corners_m: Floats = points_m[ConvexHull(points_m).vertices]
    except QhullError:
        return None
    return corners_m
