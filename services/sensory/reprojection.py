"""Projects a view's pixels to points, and points to the pixels that showed them before a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.sensing import Calibration

# What was nearer or behind counts as being here, so that nothing is divided by 0.
MIN_AHEAD_M = 0.3


class Points(NamedTuple):
    """Positions of points relative to the robot's origin, in m at the camera's height: arrays of
    one shape, or of shapes that broadcast.
    """

    ahead_m: Floats
    left_m: Floats
    up_m: Floats


def points_at(pixels: Singles, depth_m: Singles, calibration: Calibration) -> Points:
    """Return the (n,) points at (n, 2) pixels of an image whose depth is `depth_m` (h, w)."""
    nearest_column, nearest_row = np.rint(pixels).astype(int).T
    ahead_m = depth_m[nearest_row, nearest_column]

    column, row = pixels.T
    return _points(column, row, ahead_m.astype(np.float64), calibration)


def surface(depth_m: Singles, calibration: Calibration) -> Points:
    """Return the (h, w) points that all pixels of an image with the depth `depth_m` (h, w) show."""
    height_px, width_px = depth_m.shape
    column = np.arange(width_px, dtype=np.float32)
    row = np.arange(height_px, dtype=np.float32)

    return _points(column, row[:, None], depth_m.astype(np.float64), calibration)


def _points(column: Singles, row: Singles, ahead_m: Floats, calibration: Calibration) -> Points:
    left = -(column - calibration.cx_px) / calibration.fx_px
    up = -(row - calibration.cy_px) / calibration.fy_px

    return Points(
        ahead_m=ahead_m + calibration.mount_forward_m,
        left_m=left * ahead_m,
        up_m=up * ahead_m,
    )


def project_back(
    points: Points, motion: npt.NDArray[np.float64], calibration: Calibration
) -> tuple[Floats, Floats]:
    """Return the columns and rows in pixels of `points` as they were before `motion` (5, ...):
    distance, sideways, turn, pitch, roll. Several motions broadcast with the points.

    The motion is an arc: it leads in the direction half-way through the turn.
    """
    distance_m, sideways_m, turn_rad, pitch_rad, roll_rad = motion
    cos = np.cos(turn_rad)
    sin = np.sin(turn_rad)
    ahead_m = cos * points.ahead_m - sin * points.left_m
    left_m = sin * points.ahead_m + cos * points.left_m

    half_turn_rad = turn_rad / 2
    cos = np.cos(half_turn_rad)
    sin = np.sin(half_turn_rad)
    ahead_m = ahead_m + cos * distance_m - sin * sideways_m
    left_m = left_m + sin * distance_m + cos * sideways_m

    ahead_m = np.maximum(ahead_m - calibration.mount_forward_m, MIN_AHEAD_M)
    x = -left_m / ahead_m
    y = -points.up_m / ahead_m
    tilted_x = x - roll_rad * y
    tilted_y = y + roll_rad * x + pitch_rad

    column_px = tilted_x * calibration.fx_px + calibration.cx_px
    row_px = tilted_y * calibration.fy_px + calibration.cy_px
    return column_px, row_px
