"""Reads images from messages."""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Bytes
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration


def colour_image(array: Array, calibration: Calibration, name: str) -> Bytes:
    """Return the RGB image in `array`, (height, width, 3). Raises MessageError if it is not of the
    calibration's size.
    """
    expected = (calibration.height_px, calibration.width_px, 3)
    if array.dtype != "|u1" or array.shape != expected:
        raise MessageError(
            f"{name} image: expected uint8 {expected} as calibrated, "
            f"got {array.dtype} {array.shape}"
        )

    return array.numpy().astype(np.uint8, copy=False)
