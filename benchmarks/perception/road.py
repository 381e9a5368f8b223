"""The accuracy of road: of its pixels, and of its edges on the ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes, Floats, Singles
from cogmap.schemas.sensing import Calibration

GROUND = 1
ROAD = 2
WITHIN_M = 15.0
BEYOND_M = 3.0


def road_iou(found: Booleans, surface: Bytes) -> float:
    """Return the intersection over union of road; masks and surfaces are (…, h, w).

    `surface` is 2 where there is road. NaN if there is none at all.
    """
    road = surface == ROAD
    union = np.count_nonzero(found | road)
    if not union:
        return float("nan")

    common = np.count_nonzero(found & road)
    return float(common / union)


def road_edge_errors_m(
    boundary_m: npt.ArrayLike, surface: Bytes, depth_m: Singles, camera: Calibration
) -> Floats:
    """Return the distance of each point of `boundary_m` (n, 2), in the robot's frame, from the
    nearest true one of the view.

    `surface` and true `depth_m` are (h, w). Infinite if no road ends in the view.
    """
    points_m = _points_m(boundary_m)
    true_m = true_boundary_m(surface, depth_m, camera, WITHIN_M + BEYOND_M)
    return _nearest_m(points_m, true_m)


def road_edges_missed_m(
    boundary_m: npt.ArrayLike, surface: Bytes, depth_m: Singles, camera: Calibration
) -> Floats:
    """Return how far each true point where road ends within WITHIN_M is from the nearest found."""
    points_m = _points_m(boundary_m)
    true_m = true_boundary_m(surface, depth_m, camera, WITHIN_M)
    return _nearest_m(true_m, points_m)


def road_edge_error_m(errors_m: list[Floats]) -> float:
    """Return the median over all points of all views. NaN if there is no point."""
    every_m = np.concatenate([*errors_m, np.empty(0)])
    if not every_m.size:
        return float("nan")

    return float(np.median(every_m))


def true_boundary_m(
    surface: Bytes, depth_m: Singles, camera: Calibration, within_m: float
) -> Floats:
    """Return points (n, 2) half way between road and other ground that are neighbours in the image,
    in the robot's frame.

    Where something upright hides the ground, or the image ends, nobody can see the road end.
    """
    # Forward and left of the robot, (h, w, 2).
    _, width_px = depth_m.shape
    left_px = camera.cx_px - np.arange(width_px)
    left_m = left_px / camera.fx_px * depth_m
    forward_m = depth_m + camera.mount_forward_m
    ground_m = np.stack([forward_m, left_m], axis=-1).astype(np.float64)

    beside_m = _between_m(surface[:, :-1], surface[:, 1:], ground_m[:, :-1], ground_m[:, 1:])
    below_m = _between_m(surface[:-1], surface[1:], ground_m[:-1], ground_m[1:])

    every_m = np.concatenate([beside_m, below_m])
    distance_m = np.hypot(every_m[:, 0], every_m[:, 1])
    is_near = distance_m <= within_m
    return np.asarray(every_m[is_near])


def _between_m(one: Bytes, other: Bytes, one_m: Floats, other_m: Floats) -> Floats:
    """Return points (n, 2) half way between neighbouring pixels of which one is road and the other
    is other ground.

    `one` and `other` are their surfaces (h, w), `one_m` and `other_m` the ground that they show.
    """
    is_left = (one == ROAD) & (other == GROUND)
    is_entered = (one == GROUND) & (other == ROAD)
    is_boundary = is_left | is_entered
    middles_m: Floats = (one_m[is_boundary] + other_m[is_boundary]) / 2
    return middles_m


def _points_m(boundary_m: npt.ArrayLike) -> Floats:
    points_m = np.asarray(boundary_m, np.float64)
    return points_m.reshape(-1, 2)


def _nearest_m(points_m: Floats, others_m: Floats) -> Floats:
    """Return the distance from each of (n, 2) points to the nearest of (m, 2) others."""
    if not len(others_m):
        return np.full(len(points_m), np.inf)

    offsets_m = points_m[:, None] - others_m
    distances_m = np.hypot(offsets_m[..., 0], offsets_m[..., 1])
    return np.asarray(distances_m.min(axis=1))
