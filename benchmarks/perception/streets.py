"""Where the streets of a town end, from its plan."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from schemas.sensing import Pose
from services.sim.layout.plan import Rectangle

Floats = npt.NDArray[np.float64]


def edges(areas: Sequence[Rectangle]) -> Floats:
    """The outline of the union of `areas`: pieces (n, 2, 2) from point to point; none runs inside
    another area.
    """
    xs = sorted({x for west, _, east, _ in areas for x in (west, east)})
    ys = sorted({y for _, south, _, north in areas for y in (south, north)})
    pieces = []
    for west, south, east, north in areas:
        for y in (south, north):
            pieces += [
                ((a, y), (b, y)) for a, b in itertools.pairwise(xs) if west <= a and b <= east
            ]
        for x in (west, east):
            pieces += [
                ((x, a), (x, b)) for a, b in itertools.pairwise(ys) if south <= a and b <= north
            ]
    middles = [((ax + bx) / 2, (ay + by) / 2) for (ax, ay), (bx, by) in pieces]
    outer = [
        piece for piece, middle in zip(pieces, middles, strict=True) if not _inside(middle, areas)
    ]
    return np.asarray(outer, np.float64).reshape(-1, 2, 2)


def _inside(point: tuple[float, float], areas: Sequence[Rectangle]) -> bool:
    x, y = point
    return any(west < x < east and south < y < north for west, south, east, north in areas)


def distances_m(points_m: npt.ArrayLike, pieces: Floats) -> Floats:
    """From each of `points_m` (n, 2) to the nearest point of any of `pieces` (m, 2, 2)."""
    points = np.asarray(points_m, np.float64).reshape(-1, 1, 2)
    start = pieces[:, 0]
    way = pieces[:, 1] - pieces[:, 0]
    along = ((points - start) * way).sum(axis=2) / (way**2).sum(axis=1)
    nearest = start + np.clip(along, 0.0, 1.0)[..., None] * way
    return np.asarray(np.sqrt(((points - nearest) ** 2).sum(axis=2)).min(axis=1, initial=math.inf))


def in_town(points_m: npt.ArrayLike, pose: Pose) -> Floats:
    """Points (n, 2) in the robot's frame, x forward and y left, in the town's."""
    points = np.asarray(points_m, np.float64).reshape(-1, 2)
    cos = math.cos(pose.heading_rad)
    sin = math.sin(pose.heading_rad)
    return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]) + np.array([pose.x_m, pose.y_m]))
