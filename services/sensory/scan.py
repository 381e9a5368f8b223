"""The range scan: the nearest obstacle in each direction. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats, Indices, Singles
from schemas.sensing import Calibration

LOWEST_M = 0.3
HIGHEST_M = 2.0
SURE_PIXELS = 3


def scan(depth_m: Singles, calibration: Calibration, sectors: int) -> tuple[Singles, Singles]:
    """Bearing (left positive) and range of the nearest obstacle in each sector, float32 (sectors,);
    range 0 is none.

    An obstacle stands 0.3 m to 2 m over the ground. Of each image column its third-nearest such
    pixel counts, so that one or two wrong matches stop no robot. Bearing and range are from the
    robot's origin.
    """
    nearest_m = _nearest_by_column(depth_m, calibration)
    is_seen = np.isfinite(nearest_m)
    columns = np.arange(calibration.width_px)[is_seen]
    forward_m = nearest_m[is_seen] + calibration.mount_forward_m
    left_m = (calibration.cx_px - columns) / calibration.fx_px * nearest_m[is_seen]

    half_rad = _half_field_of_view_rad(calibration)
    sector_rad = 2 * half_rad / sectors
    sector = _sector(half_rad - np.arctan2(left_m, forward_m), sector_rad, sectors)
    range_m = np.full(sectors, np.inf)
    np.minimum.at(range_m, sector, np.hypot(forward_m, left_m))
    range_m[np.isinf(range_m)] = 0.0

    bearing_rad = half_rad - (np.arange(sectors) + 0.5) * sector_rad

    return bearing_rad.astype(np.float32), range_m.astype(np.float32)


def _half_field_of_view_rad(calibration: Calibration) -> float:
    half_px = max(calibration.cx_px, calibration.width_px - calibration.cx_px)
    return math.atan(half_px / calibration.fx_px)


def _sector(from_left_rad: Floats, sector_rad: float, sectors: int) -> Indices:
    """The sector of each direction, counted from the left."""
    sector = np.floor(from_left_rad / sector_rad).astype(np.int64)
    return sector.clip(0, sectors - 1)


def _nearest_by_column(depth_m: Singles, calibration: Calibration) -> Floats:
    """(width,): the third-nearest depth of an obstacle in each image column, infinite where there
    are fewer.
    """
    rows = np.arange(calibration.height_px)
    slope = (rows - calibration.cy_px) / calibration.fy_px
    below_camera_m = slope.astype(np.float32)[:, None] * depth_m

    camera_m = calibration.mount_height_m
    is_over_ground = below_camera_m < camera_m - LOWEST_M
    is_under_top = below_camera_m > camera_m - HIGHEST_M
    is_known = depth_m > 0
    is_obstacle = is_known & is_over_ground & is_under_top

    candidates_m = np.where(is_obstacle, depth_m, np.inf).astype(np.float64)
    number = SURE_PIXELS - 1
    nearest_m: Floats = np.partition(candidates_m, number, axis=0)[number]

    return nearest_m
