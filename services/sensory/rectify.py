"""Rectification: the images of two ideal pinhole cameras, side by side and parallel. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.sensing import Calibration

Maps = tuple[Singles, Singles]

# Outside these limits a calibration is refused: it is no camera's.
MIN_FOCAL_PX = 1.0
MAX_FOCAL_PX = 1e5
STRAIGHT = (0.0, 0.0, 0.0)
UNDISTORTED = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Rectification:
    """The look-up maps of one calibration, each a pair for `cv2.remap`; None if the images are
    rectified already.

    `calibration` is that of the rectified pair. The baseline runs along the left camera's x axis by
    definition (see Calibration), so the left view keeps its orientation, level on its mount, and
    only the right one is turned.
    """

    calibration: Calibration
    left_maps: Maps | None
    right_maps: Maps | None

    def apply(self, left: Bytes, right: Bytes) -> tuple[Bytes, Bytes]:
        """Return the rectified images, uint8 of the same shapes, black outside the view."""
        rectified_left = _remap(left, self.left_maps)
        rectified_right = _remap(right, self.right_maps)
        return rectified_left, rectified_right


def rectification(calibration: Calibration) -> Rectification:
    """Return the rectification for `calibration`. Raises MessageError if it describes no camera."""
    focal_px = (calibration.fx_px, calibration.fy_px)
    if min(focal_px) < MIN_FOCAL_PX or max(focal_px) > MAX_FOCAL_PX:
        raise MessageError("calibration: the focal lengths must be between 1 and 100000 pixels")

    if calibration.cx_px > calibration.width_px or calibration.cy_px > calibration.height_px:
        raise MessageError("calibration: the principal point must lie in the image")

    return _cached(msgspec.msgpack.encode(calibration))


@lru_cache(maxsize=4)
def _cached(encoded: bytes) -> Rectification:
    calibration = msgspec.msgpack.decode(encoded, type=Calibration)
    rectified = msgspec.structs.replace(
        calibration,
        right_rotation_rad=STRAIGHT,
        left_distortion=UNDISTORTED,
        right_distortion=UNDISTORTED,
    )
    left = _maps(calibration, calibration.left_distortion, STRAIGHT)
    right = _maps(calibration, calibration.right_distortion, calibration.right_rotation_rad)

    return Rectification(rectified, left, right)


def _maps(
    calibration: Calibration,
    distortion: tuple[float, ...],
    rotation_rad: tuple[float, float, float],
) -> Maps | None:
    if distortion == UNDISTORTED and rotation_rad == STRAIGHT:
        return None

    camera = np.array(
        [
            [calibration.fx_px, 0.0, calibration.cx_px],
            [0.0, calibration.fy_px, calibration.cy_px],
            [0.0, 0.0, 1.0],
        ]
    )
    to_left, _ = cv2.Rodrigues(np.array(rotation_rad))
    columns, rows = cv2.initUndistortRectifyMap(
        camera,
        np.array(distortion),
        to_left,
        camera,
        (calibration.width_px, calibration.height_px),
        cv2.CV_32FC1,
    )
    if not (np.isfinite(columns).all() and np.isfinite(rows).all()):
        raise MessageError("calibration: its distortion maps pixels to infinity")

    return columns.astype(np.float32, copy=False), rows.astype(np.float32, copy=False)


def _remap(image: Bytes, maps: Maps | None) -> Bytes:
    if maps is None:
        return image

    columns, rows = maps
    rectified = cv2.remap(image, columns, rows, cv2.INTER_LINEAR)

    return rectified.astype(np.uint8, copy=False)
