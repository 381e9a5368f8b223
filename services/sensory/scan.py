"""The range scan: the nearest obstacle in each direction. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.sensing import Calibration

# An obstacle over the ground: above kerbs, below what the robot passes under.
MIN_HEIGHT_M = 0.3
MAX_HEIGHT_M = 2.0
# Of each image column, so that one or two wrong matches stop no robot.
MIN_OBSTACLE_PIXELS = 3


# A sector's angle, 2.3 degrees, and how many there may be.
SECTOR_RAD = math.radians(75) / 32
MIN_SECTORS = 8
MAX_SECTORS = 128


def scan(depth_m: Singles, calibration: Calibration, slope: float = 0.0) -> tuple[Singles, Singles]:
    """Return bearing (left positive) and range of the nearest obstacle in each sector, float32
    (sectors,), as many as the camera's field of view has; range 0 is none.

    `slope` is by how much the ground falls away as the camera sees it, as a share of the distance.
    Of each image column its third-nearest pixel counts that shows an obstacle. Bearing and range
    are from the robot's origin.
    """
    rows = np.arange(calibration.height_px)
    down = (rows - calibration.cy_px) / calibration.fy_px - slope
    below_camera_m = down.astype(np.float32)[:, None] * depth_m
    camera_m = calibration.mount_height_m
    is_over_ground = below_camera_m < camera_m - MIN_HEIGHT_M
    is_under_top = below_camera_m > camera_m - MAX_HEIGHT_M
    is_obstacle = (depth_m > 0) & is_over_ground & is_under_top

    candidates_m = np.where(is_obstacle, depth_m, np.inf).astype(np.float64)
    number = MIN_OBSTACLE_PIXELS - 1
    by_column_m: Floats = np.partition(candidates_m, number, axis=0)[number]
    columns = np.flatnonzero(np.isfinite(by_column_m))
    ahead_m = by_column_m[columns]
    forward_m = ahead_m + calibration.mount_forward_m
    left_m = (calibration.cx_px - columns) / calibration.fx_px * ahead_m
    bearing_rad = np.arctan2(left_m, forward_m)

    right_px = calibration.width_px - calibration.cx_px
    half_rad = math.atan(max(calibration.cx_px, right_px) / calibration.fx_px)
    sectors = min(max(MIN_SECTORS, round(2 * half_rad / SECTOR_RAD)), MAX_SECTORS)
    sector_rad = 2 * half_rad / sectors
    from_left = np.floor((half_rad - bearing_rad) / sector_rad)
    sector = from_left.astype(np.int64).clip(0, sectors - 1)

    nearest_m = np.full(sectors, np.inf)
    np.minimum.at(nearest_m, sector, np.hypot(forward_m, left_m))
    nearest_m[np.isinf(nearest_m)] = 0.0

    middles = np.arange(sectors) + 0.5
    middle_rad = half_rad - middles * sector_rad
    return middle_rad.astype(np.float32), nearest_m.astype(np.float32)
