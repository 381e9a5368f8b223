"""The road in metres: an image mask projected onto the ground plane."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.ground_plane import GroundPlane, fit, focal_baseline, ray_slopes

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
    likelihood = likelihood.astype(np.float32, copy=False)
    mask = likelihood >= 0.5

    disparity_px = _disparity_px(depth_m, camera)
    plane = fit(mask, disparity_px, camera)
    ground_px = plane.disparity_image_px(mask.shape, camera)

    upright = _upright(disparity_px, ground_px)
    near = ground_px > min_disparity_px(camera)
    road_rows, road_columns = np.nonzero(mask & ~upright & near)
    road_m = _on_ground(road_rows, road_columns, plane, camera)

    upright_px = np.where(upright, disparity_px, 0.0).astype(np.float32)
    visible_ground = _visible_ground(upright_px, ground_px)

    end_rows, end_columns = _boundary_pixels(likelihood, mask, visible_ground)
    boundary_m = _on_ground(end_rows, end_columns, plane, camera)

    return thin(road_m), thin(boundary_m)


def min_disparity_px(camera: Calibration) -> float:
    """Return the disparity at MAX_RANGE_M."""
    return focal_baseline(camera) / MAX_RANGE_M


def _disparity_px(depth_m: Singles, camera: Calibration) -> Floats:
    """Of each pixel (h, w), 0 where depth is unknown."""
    known = depth_m > 0
    unknown_px = np.zeros(depth_m.shape)

    return np.divide(focal_baseline(camera), depth_m, out=unknown_px, where=known)


def _upright(disparity_px: Floats, ground_px: Floats) -> Booleans:
    """Which pixels show something that stands on the ground, (h, w)."""
    horizon_px = np.maximum(ground_px, 0.0)
    nearer_px = disparity_px - horizon_px
    limit_px = UPRIGHT_PX + UPRIGHT_SHARE * disparity_px

    nearer = nearer_px > limit_px
    as_bytes = nearer.astype(np.uint8)
    opened = cv2.morphologyEx(as_bytes, cv2.MORPH_OPEN, _SPECK)

    return np.asarray(opened > 0)


def _visible_ground(upright_px: Singles, ground_px: Floats) -> Booleans:
    """Which pixels show ground with nothing upright before it nearby, (h, w)."""
    height = ABOVE_PX + 1 + BELOW_PX
    width = 2 * BESIDE_PX + 1
    kernel = np.ones((height, width), np.uint8)

    nearest_px = cv2.dilate(upright_px, kernel, anchor=(BESIDE_PX, ABOVE_PX))
    limit_px = HIDING_SHARE * ground_px - HIDING_PX
    is_hidden = nearest_px >= limit_px

    is_ground = ground_px > 0
    return np.asarray(is_ground & ~is_hidden)


def _boundary_pixels(
    likelihood: Singles, mask: Booleans, visible_ground: Booleans
) -> tuple[Floats, Floats]:
    """Rows and columns, fractional, where the road ends on visible ground inside the image."""
    across_rows, across_columns = _crossings(likelihood, mask, visible_ground)
    down_columns, down_rows = _crossings(likelihood.T, mask.T, visible_ground.T)

    rows = np.concatenate([across_rows, down_rows])
    columns = np.concatenate([across_columns, down_columns])

    height, width = mask.shape
    inside = _inside(rows, height) & _inside(columns, width)
    return rows[inside], columns[inside]


def _inside(at: Floats, size: int) -> Booleans:
    """Which of these rows or columns are farther than BORDER_PX from the image's border."""
    middle = (size - 1) / 2
    from_middle = np.abs(at - middle)
    return np.asarray(from_middle < middle - BORDER_PX)


def _crossings(
    likelihood: Singles, mask: Booleans, visible_ground: Booleans
) -> tuple[Floats, Floats]:
    """Rows and columns where the likelihood is 0.5 between neighbours in a row, if both show
    visible ground.
    """
    left = slice(None, -1)
    right = slice(1, None)
    is_visible = visible_ground[:, left] & visible_ground[:, right]
    changes = mask[:, left] != mask[:, right]
    rows, columns = np.nonzero(is_visible & changes)

    first = likelihood[rows, columns]
    second = likelihood[rows, columns + 1]
    rise = second - first
    share = (0.5 - first) / rise

    crossed_columns = np.asarray(columns + share, np.float64)
    return rows.astype(np.float64), crossed_columns


def _on_ground(
    rows: npt.ArrayLike, columns: npt.ArrayLike, plane: GroundPlane, camera: Calibration
) -> Floats:
    """The ground points (n, 2) that these pixels show; those beyond MAX_RANGE_M are left out."""
    disparity_px = plane.disparity_px(rows, columns, camera)
    near = disparity_px > min_disparity_px(camera)
    depth_m = focal_baseline(camera) / disparity_px[near]
    forward_m = depth_m + camera.mount_forward_m

    right, _ = ray_slopes(rows, columns, camera)
    left = -right[near]
    left_m = left * depth_m
    return np.stack([forward_m, left_m], axis=1)


def thin(points_m: Floats) -> Singles:
    """Return the mean of the points (n, 2) in each cell, in the order of the cells."""
    ranges_m = np.hypot(points_m[:, 0], points_m[:, 1])
    near_m = points_m[ranges_m <= MAX_RANGE_M]

    cell = _cell_numbers(near_m)
    means_m = _means_m(near_m, cell)
    return np.asarray(means_m, np.float32)


def _means_m(points_m: Floats, cell: npt.NDArray[np.intp]) -> Floats:
    """The mean (k, 2) of the points (n, 2) in each of the cells that they are in, (n,)."""
    x_m, y_m = points_m.T
    sum_x_m = np.bincount(cell, x_m, minlength=1)
    sum_y_m = np.bincount(cell, y_m, minlength=1)
    sums_m = np.stack([sum_x_m, sum_y_m], axis=1)

    count = np.bincount(cell, minlength=1)
    occupied = np.flatnonzero(count)
    divisor = count[occupied, None]
    means_m: Floats = sums_m[occupied] / divisor
    return means_m


def _cell_numbers(points_m: Floats) -> npt.NDArray[np.intp]:
    """The number of the cell of each point (n, 2), x before y."""
    reach = round(MAX_RANGE_M / CELL_M) + 1
    in_cells = points_m / CELL_M
    lower = np.floor(in_cells)
    cells = lower.astype(np.intp)

    row, column = cells.T + reach
    columns = 2 * reach
    numbers = row * columns + column
    return np.asarray(numbers)
