"""A view's code for place recognition: the backbone's features, averaged over patches of the image.

Layers in the middle of such networks tell places apart in other light and from a little aside
better than the pixels do, and better than the last layers (Sünderhauf et al. 2015).
"""

from __future__ import annotations

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.services.epam.backbone import CHANNELS, COLUMNS, ROWS

# The first rows and columns of patches, in features. A quarter of the view's width: a step aside,
# or a turn by some degrees, moves most of what is in a patch within it.
FIRST_ROWS = (0, 3, 5)
FIRST_COLUMNS = (0, 2, 5, 8)
PATCHES = len(FIRST_ROWS) * len(FIRST_COLUMNS)
CODE_BYTES = CHANNELS * PATCHES
# Steps of a code for a standard deviation of a feature: a byte holds four to either side.
LEVELS = 32.0
MIDDLE = 128.0
# Grey levels: a view with a smaller standard deviation shows nothing.
MIN_CONTRAST = 3.0
THUMBNAIL = (40, 30)
# Of the upper half of a view this share at least must be so near.
NEAR_M = 30.0
MIN_NEAR_SHARE = 0.06


def code(features: Singles) -> Bytes:
    """Return the code, uint8 (CODE_BYTES,), of features (CHANNELS, ROWS, COLUMNS)."""
    by_row = np.add.reduceat(features, FIRST_ROWS, axis=1)
    sums = np.add.reduceat(by_row, FIRST_COLUMNS, axis=2)
    heights = np.diff((*FIRST_ROWS, ROWS))
    widths = np.diff((*FIRST_COLUMNS, COLUMNS))
    means = sums / np.outer(heights, widths)
    levels = np.rint(MIDDLE + LEVELS * means)
    return np.asarray(np.clip(levels, 0, 255).astype(np.uint8).reshape(CODE_BYTES))


def shows_place(image: Bytes, depth_m: Singles | None) -> bool:
    """Return true if an image (h, w, 3) has contrast, and enough above the horizon of its depth
    (h, w), 0 unknown, is near: distant hills identify no place. Without depth that is not asked.
    """
    thumbnail = cv2.resize(image, THUMBNAIL, interpolation=cv2.INTER_AREA)
    if thumbnail.mean(2).std() < MIN_CONTRAST:
        return False
    if depth_m is None:
        return True

    above_m = depth_m[: len(depth_m) // 2]
    near = (above_m > 0) & (above_m < NEAR_M)
    return float(near.mean()) >= MIN_NEAR_SHARE
