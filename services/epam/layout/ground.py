"""The road in metres: an image mask projected onto the ground plane."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.ground_plane import GroundPlane, fit, focal_baseline, ray_slopes

# Road farther away is left out; a cell has half the side of a place.
MAX_RANGE_M = 15.0
CELL_M = 0.5
# A pixel that is nearer than the ground by more than this is upright, unless it is a speck.
UPRIGHT_PX = 3.0
UPRIGHT_SHARE = 0.02
SPECK = np.ones((5, 3), np.uint8)
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
    boundary lies between pixels, at 0.5. Both are limited to MAX_RANGE_M and thinned to the mean
    point of each cell of CELL_M. No boundary is claimed at the image's border or behind something
    upright.
    """
    likelihood = likelihood.astype(np.float32, copy=False)
    mask = likelihood >= 0.5

    unknown_px = np.zeros(depth_m.shape)
    disparity_px = np.divide(focal_baseline(camera), depth_m, out=unknown_px, where=depth_m > 0)
    plane = fit(mask, disparity_px, camera)
    ground_px = plane.disparity_image_px(mask.shape, camera)

    nearer_px = disparity_px - np.maximum(ground_px, 0.0)
    nearer = nearer_px > UPRIGHT_PX + UPRIGHT_SHARE * disparity_px
    upright = cv2.morphologyEx(nearer.astype(np.uint8), cv2.MORPH_OPEN, SPECK) > 0

    near = ground_px > focal_baseline(camera) / MAX_RANGE_M
    road_rows, road_columns = np.nonzero(mask & ~upright & near)
    road_m = _on_ground(road_rows, road_columns, plane, camera)

    # Ground with nothing upright before it nearby.
    kernel = np.ones((ABOVE_PX + 1 + BELOW_PX, 2 * BESIDE_PX + 1), np.uint8)
    upright_px = np.where(upright, disparity_px, 0.0).astype(np.float32)
    nearest_px = cv2.dilate(upright_px, kernel, anchor=(BESIDE_PX, ABOVE_PX))
    is_hidden = nearest_px >= HIDING_SHARE * ground_px - HIDING_PX
    visible_ground = np.asarray((ground_px > 0) & ~is_hidden)

    across_rows, across_columns = _crossings(likelihood, mask, visible_ground)
    down_columns, down_rows = _crossings(likelihood.T, mask.T, visible_ground.T)
    rows = np.concatenate([across_rows, down_rows])
    columns = np.concatenate([across_columns, down_columns])

    middle_row, middle_column = (np.array(mask.shape) - 1) / 2
    inside = np.abs(rows - middle_row) < middle_row - BORDER_PX
    inside &= np.abs(columns - middle_column) < middle_column - BORDER_PX
    boundary_m = _on_ground(rows[inside], columns[inside], plane, camera)

    return thin(road_m), thin(boundary_m)


def _crossings(
    likelihood: Singles, mask: Booleans, visible_ground: Booleans
) -> tuple[Floats, Floats]:
    """Find the rows and fractional columns at which the likelihood is 0.5 between neighbours in a
    row, if both show visible ground.
    """
    is_visible = visible_ground[:, :-1] & visible_ground[:, 1:]
    changes = mask[:, :-1] != mask[:, 1:]
    rows, columns = np.nonzero(is_visible & changes)

    first = likelihood[rows, columns]
    second = likelihood[rows, columns + 1]
    share = (0.5 - first) / (second - first)
    return rows.astype(np.float64), np.asarray(columns + share, np.float64)


def _on_ground(
    rows: npt.ArrayLike, columns: npt.ArrayLike, plane: GroundPlane, camera: Calibration
) -> Floats:
    """Project these pixels onto the ground, (n, 2); leave out those beyond MAX_RANGE_M."""
    disparity_px = plane.disparity_px(rows, columns, camera)
    near = disparity_px > focal_baseline(camera) / MAX_RANGE_M
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

    reach = round(MAX_RANGE_M / CELL_M) + 1
    row, column = np.floor(near_m / CELL_M).astype(np.intp).T + reach
    cell = 2 * reach * row + column

    x_m, y_m = near_m.T
    sum_x_m = np.bincount(cell, x_m, minlength=1)
    sum_y_m = np.bincount(cell, y_m, minlength=1)
    sums_m = np.stack([sum_x_m, sum_y_m], axis=1)
    count = np.bincount(cell, minlength=1)
    occupied = np.flatnonzero(count)
    return np.asarray(sums_m[occupied] / count[occupied, None], np.float32)
