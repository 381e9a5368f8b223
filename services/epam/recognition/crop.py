"""A segment as the embedding network receives it.

The colour that a wall seems to have depends on the light. So the network also receives the colours
of ground and sky in the same light, and can learn to compensate (colour constancy).
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.recognition.segments import Segment

# The network's input. The weights are trained with all of these values.
SIDE_PX = 48
CHANNELS = 12
# Around a segment, as a share of its longer side.
MARGIN = 0.04
# Stands for the distance of a segment without any depth.
UNKNOWN_DISTANCE_M = 30.0
# Factor on the logarithm of depths: what is 28 % farther than the segment has 1, the largest.
RELIEF = 4.0
# Ground is what is lower. Its colour, and the sky's, is the median of so many pixels at least, one
# in STRIDE_PX each way.
GROUND_M = 0.3
MIN_PIXELS = 12
STRIDE_PX = 2


def surroundings(image: Bytes, depth_m: Singles, camera: Calibration) -> Singles:
    """Return the median colours of ground and sky, as `colours`, float32 (6,), 0 for one that is
    not in view.

    Pixels without depth above the horizon show the sky.
    """
    image = image[::STRIDE_PX, ::STRIDE_PX]
    depth_m = depth_m[::STRIDE_PX, ::STRIDE_PX]
    rows = STRIDE_PX * np.arange(len(depth_m), dtype=np.float32)[:, None]
    down = (rows - np.float32(camera.cy_px)) / np.float32(camera.fy_px)
    height_m = camera.mount_height_m - down * depth_m

    is_known = depth_m > 0
    ground = is_known & (down > 0) & (height_m < GROUND_M)
    sky = ~is_known & (down < 0)

    medians = np.zeros((2, 3), np.float32)
    for row, is_shown in enumerate((ground, sky)):
        pixels = image[is_shown]
        if len(pixels) >= MIN_PIXELS:
            medians[row] = colours(np.median(pixels, axis=0))
    return medians.ravel()


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
    # A square about the segment, with a margin; parts of it may be outside the image.
    left, top, width, height = segment.box_px
    side = round(max(width, height) * (1 + 2 * MARGIN))
    rows, rows_in_square = _overlap(top + height // 2 - side // 2, side, len(depth_m))
    columns, columns_in_square = _overlap(left + width // 2 - side // 2, side, depth_m.shape[1])
    mask = segment.mask[rows, columns]
    square_m = depth_m[rows, columns]
    is_known = square_m > 0
    own_m = square_m[is_known & mask]
    distance_m = float(np.median(own_m)) if len(own_m) else UNKNOWN_DISTANCE_M

    shown = np.zeros((side, side, 4), np.float32)
    inside = shown[rows_in_square, columns_in_square]
    inside[..., :3] = colours(image[rows, columns]) * mask[..., None]
    inside[..., 3] = mask

    relief = np.zeros((side, side), np.float32)
    log_ratio = np.log(np.where(is_known, square_m, distance_m) / distance_m)
    relief[rows_in_square, columns_in_square] = (RELIEF * log_ratio).clip(-1, 1)

    side_m = side * distance_m / focal_px
    values = np.empty((CHANNELS, SIDE_PX, SIDE_PX), np.float32)
    values[:4] = _resized(shown).transpose(2, 0, 1)
    values[4] = _resized(relief)
    values[5] = float(np.log(max(side_m, 1.0)) / 2.0 - 1.0)
    values[6:] = around[:, None, None]
    return values


def _overlap(start: int, length: int, size: int) -> tuple[slice, slice]:
    """Find which of `length` pixels from `start` on are inside an image of `size`: where these are
    in the image, and where among the `length` pixels.
    """
    first = max(start, 0)
    last = min(start + length, size)
    return slice(first, last), slice(first - start, last - start)


def _resized(square: Singles) -> Singles:
    """Resize `square` to sides of SIDE_PX."""
    interpolation = cv2.INTER_AREA if len(square) > SIDE_PX else cv2.INTER_LINEAR
    resized = cv2.resize(square, (SIDE_PX, SIDE_PX), interpolation=interpolation)
    return resized.astype(np.float32, copy=False)
