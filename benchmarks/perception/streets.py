"""The edges of a town's streets, from its plan."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import nearest_on_pieces
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.sensing import Pose

Point = tuple[float, float]
Piece = tuple[Point, Point]


def edges(areas: Sequence[tuple[float, float, float, float]]) -> Floats:
    """Find the outline of the union of `areas`: pieces (n, 2, 2) from point to point.

    None runs inside another area.
    """
    corners = np.asarray(areas, np.float64).reshape(-1, 2, 2)
    xs = np.unique(corners[..., 0]).tolist()
    ys = np.unique(corners[..., 1]).tolist()
    outer = []

    # The sides of an area are cut at every x and y, so that each piece is inside another or not.
    for west, south, east, north in areas:
        sides: list[Piece] = []
        for x, beyond_x in itertools.pairwise(xs):
            if west <= x and beyond_x <= east:
                sides += [((x, south), (beyond_x, south)), ((x, north), (beyond_x, north))]

        for y, beyond_y in itertools.pairwise(ys):
            if south <= y and beyond_y <= north:
                sides += [((west, y), (west, beyond_y)), ((east, y), (east, beyond_y))]

        for start, end in sides:
            x, y = ((start[axis] + end[axis]) / 2 for axis in (0, 1))
            if not any(w < x < e and s < y < n for w, s, e, n in areas):
                outer.append((start, end))

    pieces = np.asarray(outer, np.float64)
    return pieces.reshape(-1, 2, 2)


def distances_m(points_m: npt.ArrayLike, pieces: Floats) -> Floats:
    """Measure from each of `points_m` (n, 2) to the nearest point of any of `pieces` (m, 2, 2)."""
    points = np.asarray(points_m, np.float64)
    nearest = nearest_on_pieces(pieces[:, 0], pieces[:, 1], points)
    offset_m = points - nearest.foot_m
    return np.asarray(np.hypot(offset_m[:, 0], offset_m[:, 1]))


def in_town(points_m: npt.ArrayLike, pose: Pose) -> Floats:
    """Transform points (n, 2) in the robot's frame, x forward and y left, to the town's."""
    robot = np.array([pose.x_m, pose.y_m, pose.heading_rad])
    points = np.asarray(points_m, np.float64)
    return transform_from(robot, points.reshape(-1, 2))
