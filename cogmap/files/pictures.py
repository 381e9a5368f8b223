"""Pictures, decoded once their heads say that they are not too large: few bytes may be gigabytes of
pixels.
"""

from __future__ import annotations

import io
import warnings

import cv2
import numpy as np
from PIL import Image

from cogmap.errors import BoundError
from cogmap.geometry.arrays import Bytes

MAX_PIXELS = 1 << 25
FORMATS = ("PNG", "JPEG", "JPEG2000", "WEBP", "BMP", "PPM", "TIFF")


def decoded(content: Bytes, name: str) -> Bytes | None:
    """Return a picture in a file's bytes (n,), uint8 (h, w) if it is grey, else RGB (h, w, 3), of
    16 bits the upper 8. None if it is no whole one.

    Raises BoundError, naming it by `name`, if it has more than MAX_PIXELS.
    """
    try:
        with warnings.catch_warnings(action="ignore"):
            head = Image.open(io.BytesIO(content.tobytes()), formats=FORMATS)
        width_px, height_px = head.size
        # OpenCV makes room for as much as a chunk says that it has.
        head.verify()
    except Image.DecompressionBombError:
        width_px = height_px = MAX_PIXELS
    except Exception:  # each of its readers raises what the nonsense in a file leads to
        return None

    if width_px * height_px > MAX_PIXELS:
        raise BoundError(
            f"{name} has more than {MAX_PIXELS} pixels, the bound for a picture: make it smaller"
        )
    try:
        image = cv2.imdecode(content, cv2.IMREAD_ANYCOLOR)
    except cv2.error:
        return None
    if image is None:
        return None
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return np.asarray(image, np.uint8)
