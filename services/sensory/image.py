"""Reads a frame's images from its message, at the size that they are worked at."""

from __future__ import annotations

import math

import cv2
import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration

MIN_SIDE_PX = 16


def check_image(array: Array, calibration: Calibration, name: str) -> None:
    """Raise MessageError if the image in `array` is not grey or RGB, of the calibration's size."""
    size = (calibration.height_px, calibration.width_px)
    if array.dtype != "|u1" or array.shape not in (size, (*size, 3)):
        raise MessageError(
            f"{name} image: expected uint8 {size} or {(*size, 3)} as calibrated, "
            f"got {array.dtype} {array.shape}"
        )


def working_calibration(calibration: Calibration, max_pixels: int) -> Calibration:
    """Return the calibration of the images when they are made so small that they have at most
    `max_pixels`.
    """
    pixels = calibration.width_px * calibration.height_px
    if pixels <= max_pixels:
        return calibration

    scale = math.sqrt(max_pixels / pixels)
    width_px = max(MIN_SIDE_PX, int(calibration.width_px * scale))
    height_px = max(MIN_SIDE_PX, int(calibration.height_px * scale))
    across = width_px / calibration.width_px
    down = height_px / calibration.height_px
    # The middle of the first pixel is at 0.
    return msgspec.structs.replace(
        calibration,
        width_px=width_px,
        height_px=height_px,
        fx_px=calibration.fx_px * across,
        fy_px=calibration.fy_px * down,
        cx_px=(calibration.cx_px + 0.5) * across - 0.5,
        cy_px=(calibration.cy_px + 0.5) * down - 0.5,
    )


def colour_image(array: Array, calibration: Calibration, name: str, working: Calibration) -> Bytes:
    """Return the image in `array` as RGB (h, w, 3), as large as `working` says. Raises MessageError
    as `check_image` does.
    """
    check_image(array, calibration, name)
    image = array.numpy().astype(np.uint8, copy=False)
    if working != calibration:
        size = (working.width_px, working.height_px)
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    if image.ndim == 2:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), np.uint8)
    return image


def grey_image(image: Bytes) -> Bytes:
    """Return an RGB image (h, w, 3) as grey (h, w)."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
