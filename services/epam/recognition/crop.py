"""A segment as the embedding network receives it.

The colour that a wall seems to have depends on the light. So the network also receives the colours
of ground and sky in the same light, and can learn to compensate (colour constancy).
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from schemas.sensing import Calibration
from services.epam.recognition.segments import Segment

SIDE_PX = 48
CHANNELS = 12
MARGIN = 0.04
UNKNOWN_DISTANCE_M = 30.0
RELIEF = 4.0
GROUND_M = 0.3
MIN_PIXELS = 12
STRIDE_PX = 2


def surroundings(image: Bytes, depth_m: Singles, camera: Calibration) -> Singles:
    """Return the median colours of ground and sky, as `colours`, float32 (6,), 0 for what is not in
    view.

    The sky is what has no depth, above the horizon.
    """
    image = image[::STRIDE_PX, ::STRIDE_PX]
    depth_m = depth_m[::STRIDE_PX, ::STRIDE_PX]
    rows = STRIDE_PX * np.arange(depth_m.shape[0], dtype=np.float32)[:, None]
    down = (rows - np.float32(camera.cy_px)) / np.float32(camera.fy_px)
    height_m = camera.mount_height_m - down * depth_m

    ground = (depth_m > 0) & (down > 0) & (height_m < GROUND_M)
    sky = (depth_m == 0) & (down < 0)
    return np.concatenate([_median_colour(image[ground]), _median_colour(image[sky])])


def _median_colour(pixels: Bytes) -> Singles:
    if len(pixels) < MIN_PIXELS:
        return np.zeros(3, np.float32)
    return colours(np.median(pixels, axis=0))


def colours(levels: npt.ArrayLike) -> Singles:
    """Return levels of 0 to 255 as the network receives them."""
    return np.asarray(levels, np.float32) / 64.0 - 2.0


def crop(
    image: Bytes, depth_m: Singles, segment: Segment, around: Singles, focal_px: float
) -> Singles:
    """Return `segment` of a view as float32 (CHANNELS, SIDE_PX, SIDE_PX).

    Channels are three colours, 0 outside the segment; its mask; how much farther than the segment
    each pixel is; the logarithm of the side's length in metres; and the `surroundings`.
    """
    left, top, width, height = segment.box_px
    side = round(max(width, height) * (1 + 2 * MARGIN))
    source, target = _overlap(
        left + width // 2 - side // 2, top + height // 2 - side // 2, side, depth_m.shape
    )
    mask = segment.mask[source]
    distance_m = _distance_m(depth_m[source], mask)

    square = np.zeros((side, side, 4), np.float32)
    square[*target, :3] = colours(image[source]) * mask[..., None]
    square[*target, 3] = mask
    relief = np.zeros((side, side), np.float32)
    relief[target] = _relief(depth_m[source], distance_m)

    size = (SIDE_PX, SIDE_PX)
    interpolation = cv2.INTER_AREA if side > SIDE_PX else cv2.INTER_LINEAR
    values = np.empty((CHANNELS, *size), np.float32)
    values[:4] = cv2.resize(square, size, interpolation=interpolation).transpose(2, 0, 1)
    values[4] = cv2.resize(relief, size, interpolation=interpolation)
    values[5] = np.log(max(side * distance_m / focal_px, 1.0)) / 2.0 - 1.0
    values[6:] = around[:, None, None]
    return values


def _distance_m(depth_m: Singles, mask: Booleans) -> float:
    """The median known depth within `mask`."""
    own_m = depth_m[(depth_m > 0) & mask]
    return float(np.median(own_m)) if len(own_m) else UNKNOWN_DISTANCE_M


def _relief(depth_m: Singles, distance_m: float) -> Singles:
    """Log ratio of depth to `distance_m`, scaled and clipped to -1 to 1, 0 where unknown."""
    filled_m = np.where(depth_m > 0, depth_m, distance_m)
    return np.asarray((RELIEF * np.log(filled_m / distance_m)).clip(-1, 1))


def _overlap(
    left: int, top: int, side: int, size: tuple[int, ...]
) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Of the square at `left`, `top`, the part inside an image of `size` (h, w): its rows and
    columns in the image, and in the square.
    """
    first_row = max(top, 0)
    first_column = max(left, 0)
    last_row = min(top + side, size[0])
    last_column = min(left + side, size[1])

    source = slice(first_row, last_row), slice(first_column, last_column)
    target = (
        slice(first_row - top, last_row - top),
        slice(first_column - left, last_column - left),
    )
    return source, target
