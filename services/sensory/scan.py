"""The range scan: the nearest obstacle in each direction."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.sensory.image import Floats

LOWEST_M = 0.3
HIGHEST_M = 2.0
SURE_PIXELS = 3


def scan(depth_m: Floats, calibration: Calibration, sectors: int) -> tuple[Floats, Floats]:
    """Bearing (left positive) and range of the nearest obstacle in each sector, float32 (sectors,);
    range 0 is none.

    An obstacle is what stands 0.3 m to 2 m over the ground. Of each image column its third-nearest
    such pixel counts, so that one or two wrong matches stop nobody. Bearing and range are from the
    robot's origin.
    """
    nearest = _nearest_by_column(depth_m, calibration)
    seen = np.isfinite(nearest)
    column = np.arange(calibration.width_px)
    forward = nearest[seen] + calibration.mount_forward_m
    left = (calibration.cx_px - column[seen]) / calibration.fx_px * nearest[seen]
    half_rad = math.atan(
        max(calibration.cx_px, calibration.width_px - calibration.cx_px) / calibration.fx_px
    )
    width_rad = 2 * half_rad / sectors
    sector = (
        np.floor((half_rad - np.arctan2(left, forward)) / width_rad)
        .astype(np.intp)
        .clip(0, sectors - 1)
    )
    ranges = np.full(sectors, np.inf)
    np.minimum.at(ranges, sector, np.hypot(forward, left))
    bearings = half_rad - (np.arange(sectors) + 0.5) * width_rad
    return bearings.astype(np.float32), np.where(np.isfinite(ranges), ranges, 0.0).astype(
        np.float32
    )


def _nearest_by_column(depth_m: Floats, calibration: Calibration) -> npt.NDArray[np.float64]:
    slope = ((np.arange(calibration.height_px) - calibration.cy_px) / calibration.fy_px).astype(
        np.float32
    )[:, None]
    below_camera_m = slope * depth_m
    height = calibration.mount_height_m
    obstacle = (
        (depth_m > 0) & (below_camera_m < height - LOWEST_M) & (below_camera_m > height - HIGHEST_M)
    )
    candidates = np.where(obstacle, depth_m, np.inf).astype(np.float64)
    nearest: npt.NDArray[np.float64] = np.partition(candidates, SURE_PIXELS - 1, axis=0)[
        SURE_PIXELS - 1
    ]
    return nearest
