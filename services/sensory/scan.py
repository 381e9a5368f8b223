"""The range scan: the nearest obstacle in each direction. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats, Indices, Singles
from cogmap.schemas.sensing import Calibration

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
    bearing_rad, range_m = _obstacles(depth_m, calibration)

    half_rad = _half_field_of_view_rad(calibration)
    sector_rad = 2 * half_rad / sectors
    sector = _sector(half_rad - bearing_rad, sector_rad, sectors)

    nearest_m = np.full(sectors, np.inf)
    np.minimum.at(nearest_m, sector, range_m)
    nearest_m[np.isinf(nearest_m)] = 0.0

    middles = np.arange(sectors) + 0.5
    middle_rad = half_rad - middles * sector_rad
    return middle_rad.astype(np.float32), nearest_m.astype(np.float32)


def _obstacles(depth_m: Singles, calibration: Calibration) -> tuple[Floats, Floats]:
    """Bearing and range of the nearest obstacle in each image column that has one, (k,) each."""
    by_column_m = _nearest_by_column(depth_m, calibration)
    is_seen = np.isfinite(by_column_m)

    nearest_m = by_column_m[is_seen]
    columns = np.arange(calibration.width_px)[is_seen]

    forward_m = nearest_m + calibration.mount_forward_m
    left_m = (calibration.cx_px - columns) / calibration.fx_px * nearest_m

    return np.arctan2(left_m, forward_m), np.hypot(forward_m, left_m)


def _half_field_of_view_rad(calibration: Calibration) -> float:
    right_px = calibration.width_px - calibration.cx_px
    half_px = max(calibration.cx_px, right_px)
    return math.atan(half_px / calibration.fx_px)


def _sector(from_left_rad: Floats, sector_rad: float, sectors: int) -> Indices:
    """The sector of each direction, counted from the left."""
    sector = np.floor(from_left_rad / sector_rad)
    last = sectors - 1
    return sector.astype(np.int64).clip(0, last)


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
    ordered_m = np.partition(candidates_m, number, axis=0)

    nearest_m: Floats = ordered_m[number]
    return nearest_m
