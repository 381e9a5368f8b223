"""The road in metres: an image mask projected onto the ground plane."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats, Singles
from schemas.sensing import Calibration
from services.epam.layout.ground_plane import GroundPlane, fit, focal_baseline, ray_slopes

MAX_RANGE_M = 15.0
CELL_M = 0.5
# What is nearer than the ground by more than this is upright, if it is larger than a speck.
UPRIGHT_PX = 3.0
UPRIGHT_SHARE = 0.02
_SPECK = np.ones((5, 3), np.uint8)
# Neighbourhood of a boundary pixel in which an upright thing may hide the rest of the road.
BESIDE_PX = 4
ABOVE_PX = 12
BELOW_PX = 2
HIDING_SHARE = 0.93
HIDING_PX = 0.3
BORDER_PX = 3


def project(likelihood: Singles, depth_m: Singles, camera: Calibration) -> tuple[Singles, Singles]:
    """Return the road and its boundary as ground points in the robot's frame, x forward, y left,
    float32 (n, 2) each.

    `likelihood` and `depth_m` are (h, w). A pixel is road if its likelihood is at least 0.5; the
    boundary lies between pixels, where it would be 0.5. Both are limited to MAX_RANGE_M and thinned
    to the mean point of each cell of CELL_M. No boundary is claimed where the image ends or where
    something upright hides what is behind it.
    """
    unknown = np.zeros(depth_m.shape)
    disparity_px = np.divide(focal_baseline(camera), depth_m, out=unknown, where=depth_m > 0)
    likelihood = likelihood.astype(np.float32, copy=False)
    mask = likelihood >= 0.5
    plane = fit(mask, disparity_px, camera)

    height, width = mask.shape
    image_rows = np.arange(height)[:, None]
    ground_px = plane.disparity_px(image_rows, np.arange(width), camera)
    upright = _upright(disparity_px, ground_px)
    near = ground_px > focal_baseline(camera) / MAX_RANGE_M
    road_rows, road_columns = np.nonzero(mask & ~upright & near)

    upright_px = np.where(upright, disparity_px, 0.0).astype(np.float32)
    visible_ground = _visible_ground(upright_px, ground_px)
    end_rows, end_columns = _boundary_pixels(likelihood, mask, visible_ground)

    road_m = _on_ground(road_rows, road_columns, plane, camera)
    boundary_m = _on_ground(end_rows, end_columns, plane, camera)
    return thin(road_m), thin(boundary_m)


def _upright(disparity_px: Floats, ground_px: Floats) -> Booleans:
    """Which pixels show something that stands on the ground, (h, w)."""
    nearer_px = disparity_px - np.maximum(ground_px, 0.0)
    nearer = nearer_px > UPRIGHT_PX + UPRIGHT_SHARE * disparity_px
    opened = cv2.morphologyEx(nearer.astype(np.uint8), cv2.MORPH_OPEN, _SPECK)
    return np.asarray(opened > 0)


def _visible_ground(upright_px: Singles, ground_px: Floats) -> Booleans:
    """Which pixels show ground with nothing upright before it nearby, (h, w)."""
    kernel = np.ones((ABOVE_PX + 1 + BELOW_PX, 2 * BESIDE_PX + 1), np.uint8)
    nearest_px = cv2.dilate(upright_px, kernel, anchor=(BESIDE_PX, ABOVE_PX))
    return np.asarray((ground_px > 0) & (nearest_px < HIDING_SHARE * ground_px - HIDING_PX))


def _boundary_pixels(
    likelihood: Singles, mask: Booleans, visible_ground: Booleans
) -> tuple[Floats, Floats]:
    """Rows and columns, fractional, where the road ends on visible ground inside the image."""
    visible = visible_ground[:, :-1] & visible_ground[:, 1:]
    rows, columns = np.nonzero(visible & (mask[:, :-1] != mask[:, 1:]))
    crossing = _crossing(likelihood[rows, columns], likelihood[rows, columns + 1])
    beside_rows = rows
    beside_columns = columns + crossing

    visible = visible_ground[:-1] & visible_ground[1:]
    rows, columns = np.nonzero(visible & (mask[:-1] != mask[1:]))
    crossing = _crossing(likelihood[rows, columns], likelihood[rows + 1, columns])
    above_rows = rows + crossing
    above_columns = columns

    all_rows = np.concatenate([beside_rows, above_rows]).astype(np.float64)
    all_columns = np.concatenate([beside_columns, above_columns]).astype(np.float64)
    height, width = mask.shape
    inside = _inside(all_rows, height) & _inside(all_columns, width)
    return all_rows[inside], all_columns[inside]


def _inside(at: Floats, size: int) -> Booleans:
    """Which of these rows or columns are farther than BORDER_PX from the image's border."""
    middle = (size - 1) / 2
    return np.asarray(np.abs(at - middle) < middle - BORDER_PX)


def _crossing(first: Singles, second: Singles) -> Singles:
    """Where the likelihood is 0.5 between two neighbours: 0 at the first, 1 at the second."""
    return np.asarray((0.5 - first) / (second - first), np.float32)


def _on_ground(
    rows: npt.ArrayLike, columns: npt.ArrayLike, plane: GroundPlane, camera: Calibration
) -> Floats:
    """The ground points (n, 2) that these pixels show; those beyond MAX_RANGE_M are left out."""
    disparity_px = plane.disparity_px(rows, columns, camera)
    near = disparity_px > focal_baseline(camera) / MAX_RANGE_M
    depth_m = focal_baseline(camera) / disparity_px[near]
    right, _ = ray_slopes(rows, columns, camera)

    forward_m = depth_m + camera.mount_forward_m
    left_m = -right[near] * depth_m
    return np.stack([forward_m, left_m], axis=1)


def thin(points_m: Floats) -> Singles:
    """Return the mean of the points (n, 2) in each cell, in the order of the cells."""
    ranges_m = np.hypot(points_m[:, 0], points_m[:, 1])
    near_m = points_m[ranges_m <= MAX_RANGE_M]
    reach = round(MAX_RANGE_M / CELL_M) + 1
    cells = np.floor(near_m / CELL_M).astype(np.intp) + reach
    cell = cells[:, 0] * 2 * reach + cells[:, 1]

    count = np.bincount(cell, minlength=1)
    occupied = np.flatnonzero(count)
    sums = [np.bincount(cell, near_m[:, axis], minlength=1)[occupied] for axis in (0, 1)]
    means = np.stack(sums, axis=1) / count[occupied, None]
    return np.asarray(means, np.float32)
