"""Images of ROS as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np

from cogmap.errors import UsageError
from cogmap.files.pictures import decoded
from cogmap.geometry.arrays import Bytes

REMEDY = "send or record it again, or cut this part of the bag off"


class Encoding(NamedTuple):
    """How many channels and bytes a pixel has, and OpenCV's code that makes RGB of it."""

    channels: int
    item_bytes: int = 1
    to_rgb: int | None = None


ENCODINGS = {
    "mono8": Encoding(1),
    "8UC1": Encoding(1),
    "mono16": Encoding(1, 2),
    "rgb8": Encoding(3),
    "bgr8": Encoding(3, to_rgb=cv2.COLOR_BGR2RGB),
    "8UC3": Encoding(3, to_rgb=cv2.COLOR_BGR2RGB),
    "rgba8": Encoding(4, to_rgb=cv2.COLOR_RGBA2RGB),
    "bgra8": Encoding(4, to_rgb=cv2.COLOR_BGRA2RGB),
    "bayer_rggb8": Encoding(1, to_rgb=cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr8": Encoding(1, to_rgb=cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg8": Encoding(1, to_rgb=cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg8": Encoding(1, to_rgb=cv2.COLOR_BayerGRBG2RGB),
    "bayer_rggb16": Encoding(1, 2, cv2.COLOR_BayerRGGB2RGB),
    "bayer_bggr16": Encoding(1, 2, cv2.COLOR_BayerBGGR2RGB),
    "bayer_gbrg16": Encoding(1, 2, cv2.COLOR_BayerGBRG2RGB),
    "bayer_grbg16": Encoding(1, 2, cv2.COLOR_BayerGRBG2RGB),
}


def image_of(message: Any, name: str) -> Bytes:
    """Return an Image or a CompressedImage, uint8 (h, w) if it is grey, else RGB (h, w, 3); of 16
    bits the upper 8.

    Raises UsageError, naming it by `name`, if it cannot be decoded, or has another encoding.
    """
    image = _unpacked(message, name) if hasattr(message, "format") else _raw(message, name)
    return np.asarray(image, np.uint8)


def _unpacked(message: Any, name: str) -> Any:
    image = decoded(np.asarray(message.data, np.uint8), name)
    if image is None:
        raise UsageError(f"{name} cannot be decoded as {message.format or 'an image'}: {REMEDY}")
    return image


def _raw(message: Any, name: str) -> Any:
    encoding = ENCODINGS.get(message.encoding)
    if encoding is None:
        raise UsageError(
            f"{name} has the encoding {message.encoding!r}: give it as one of "
            f"{', '.join(ENCODINGS)}, or compressed"
        )

    height, width, step = message.height, message.width, message.step
    row_bytes = width * encoding.channels * encoding.item_bytes
    if not row_bytes or step < row_bytes or len(message.data) < height * step:
        raise UsageError(
            f"{name} cannot be decoded: {len(message.data)} bytes for {width} x {height} pixels, "
            f"{message.encoding}: {REMEDY}"
        )

    rows = message.data[: height * step].reshape(height, step)[:, :row_bytes]
    if encoding.item_bytes == 2:
        first = 0 if message.is_bigendian else 1
        rows = rows[:, first::2]
    pixels = np.ascontiguousarray(rows).reshape(height, width, encoding.channels)
    if encoding.channels == 1:
        pixels = pixels[:, :, 0]
    return pixels if encoding.to_rgb is None else cv2.cvtColor(pixels, encoding.to_rgb)
