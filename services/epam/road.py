"""Where the road is: asphalt by its colour, on the ground plane."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.appearance import Image

FARTHEST_M = 15.0
CELL_M = 0.5
DARKEST, LIGHTEST, MOST_CHROMA = 50, 130, 9
PLANE_ERROR_PX = 1.0
_OPEN = np.ones((3, 3), np.uint8)
_CLOSE = np.ones((5, 5), np.uint8)


def road(lab_image: Image, depth_m: npt.NDArray[np.float32], camera: Calibration) -> npt.NDArray[np.float32]:
    """Ground points seen as road, float32 (n, 2), x forward and y left of the robot, one in each cell of CELL_M.

    A pixel is road if it is as grey and dark as asphalt and its depth, where known, is that of the ground. Specks
    are taken out of the mask, and gaps as small as a lane marking filled.
    """
    rows = np.arange(camera.height_px)
    below = (rows - camera.cy_px) / camera.fy_px
    ground_m = np.where(below > 0, camera.mount_height_m / np.maximum(below, 1e-9), np.inf)
    first = int(np.searchsorted(-ground_m, -FARTHEST_M))
    if first >= len(rows):
        return np.empty((0, 2), np.float32)
    depth = ground_m[first:, None]
    mask = _asphalt(lab_image[first:]) & _on_plane(depth_m[first:], depth, camera)
    cleaned = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _OPEN)
    cleaned = cv2.morphologyEx(cleaned, cv2.MORPH_CLOSE, _CLOSE)
    row, column = np.nonzero(cleaned)
    forward = depth[row, 0]
    left = (camera.cx_px - column) / camera.fx_px * forward
    return _thinned(np.stack([forward + camera.mount_forward_m, left], axis=1))


def _asphalt(lab_image: Image) -> npt.NDArray[np.bool_]:
    lightness = lab_image[..., 0]
    chroma = np.abs(lab_image[..., 1:].astype(np.int16) - 128).max(-1)
    return np.asarray((lightness >= DARKEST) & (lightness <= LIGHTEST) & (chroma <= MOST_CHROMA))


def _on_plane(
    depth_m: npt.NDArray[np.float32], ground_m: npt.NDArray[np.float64], camera: Calibration
) -> npt.NDArray[np.bool_]:
    focal_baseline = camera.fx_px * camera.baseline_m
    known = depth_m > 0
    error_px = focal_baseline / np.where(known, depth_m, 1.0) - focal_baseline / ground_m
    return np.asarray(~known | (np.abs(error_px) < PLANE_ERROR_PX + 0.05 * focal_baseline / ground_m))


def _thinned(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """The mean of the points in each cell, in order of the cells."""
    near = points[np.hypot(points[:, 0], points[:, 1]) <= FARTHEST_M]
    reach = round(FARTHEST_M / CELL_M) + 1
    cells = np.floor(near / CELL_M).astype(np.intp) + reach
    cell = cells[:, 0] * 2 * reach + cells[:, 1]
    count = np.bincount(cell, minlength=1)
    kept = np.flatnonzero(count)
    sums = np.stack([np.bincount(cell, near[:, axis], minlength=1)[kept] for axis in (0, 1)], axis=1)
    return np.asarray(sums / count[kept, None], np.float32)
