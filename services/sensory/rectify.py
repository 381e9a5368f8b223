"""Rectification: both images as two ideal pinhole cameras, side by side and parallel, would have
given them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import msgspec
import numpy as np

from cogmap.errors import MessageError
from schemas.sensing import Calibration
from services.sensory.image import Bytes, Floats

_STRAIGHT = (0.0, 0.0, 0.0)
_UNDISTORTED = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Rectification:
    """The look-up maps of one calibration, each a pair for `cv2.remap`; None where the images are
    rectified already.

    `calibration` is that of the rectified pair. The baseline runs along the left camera's x axis by
    definition (see Calibration), so the left view keeps its orientation, level on its mount, and
    only the right one is turned.
    """

    calibration: Calibration
    left_maps: tuple[Floats, Floats] | None
    right_maps: tuple[Floats, Floats] | None

    def apply(self, left: Bytes, right: Bytes) -> tuple[Bytes, Bytes]:
        """The rectified images, uint8 of the same shapes; what no camera saw is black."""
        return _remap(left, self.left_maps), _remap(right, self.right_maps)


def rectification(calibration: Calibration) -> Rectification:
    """The rectification for `calibration`. Raises MessageError where it describes no camera."""
    if (
        min(calibration.fx_px, calibration.fy_px) < 1.0
        or max(calibration.fx_px, calibration.fy_px) > 1e5
    ):
        raise MessageError("calibration: the focal lengths must be between 1 and 100000 pixels")
    if calibration.cx_px > calibration.width_px or calibration.cy_px > calibration.height_px:
        raise MessageError("calibration: the principal point must lie in the image")
    return _cached(msgspec.msgpack.encode(calibration))


@lru_cache(maxsize=4)
def _cached(encoded: bytes) -> Rectification:
    given = msgspec.msgpack.decode(encoded, type=Calibration)
    plain = msgspec.structs.replace(
        given,
        right_rotation_rad=_STRAIGHT,
        left_distortion=_UNDISTORTED,
        right_distortion=_UNDISTORTED,
    )
    left = _maps(given, given.left_distortion, _STRAIGHT)
    right = _maps(given, given.right_distortion, given.right_rotation_rad)
    return Rectification(plain, left, right)


def _maps(
    calibration: Calibration,
    distortion: tuple[float, ...],
    rotation_rad: tuple[float, float, float],
) -> tuple[Floats, Floats] | None:
    if distortion == _UNDISTORTED and rotation_rad == _STRAIGHT:
        return None
    camera = np.array(
        [
            [calibration.fx_px, 0.0, calibration.cx_px],
            [0.0, calibration.fy_px, calibration.cy_px],
            [0.0, 0.0, 1.0],
        ]
    )
    to_left, _ = cv2.Rodrigues(np.array(rotation_rad))
    size = (calibration.width_px, calibration.height_px)
    maps = cv2.initUndistortRectifyMap(
        camera, np.array(distortion), to_left, camera, size, cv2.CV_32FC1
    )
    if not all(np.isfinite(part).all() for part in maps):
        raise MessageError("calibration: its distortion maps pixels to infinity")
    return maps[0].astype(np.float32, copy=False), maps[1].astype(np.float32, copy=False)


def _remap(image: Bytes, maps: tuple[Floats, Floats] | None) -> Bytes:
    return (
        image
        if maps is None
        else cv2.remap(image, maps[0], maps[1], cv2.INTER_LINEAR).astype(np.uint8, copy=False)
    )
