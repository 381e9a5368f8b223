"""A segment as the embedding network receives it.

The colour that a wall seems to have depends on the light. So the network also receives the colours
of ground and sky in the same light, and can learn to compensate (colour constancy).
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.recognition.segments import Segment

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
    down = _downward_slopes(len(depth_m), camera)
    height_m = camera.mount_height_m - down * depth_m
    is_known = depth_m > 0
    is_low = height_m < GROUND_M

    ground = is_known & (down > 0) & is_low
    sky = ~is_known & (down < 0)

    of_ground = _median_colour(image[ground])
    of_sky = _median_colour(image[sky])
    return np.concatenate([of_ground, of_sky])


def _downward_slopes(count: int, camera: Calibration) -> Singles:
    """The slopes of the rays of `count` rows, every STRIDE_PX, (count, 1)."""
    numbers = np.arange(count, dtype=np.float32)
    rows = STRIDE_PX * numbers
    below_px = rows - np.float32(camera.cy_px)

    slopes = below_px / np.float32(camera.fy_px)
    return np.asarray(slopes[:, None])


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
    first_column, first_row, side = _square(segment)
    source, target = _overlap(first_column, first_row, side, depth_m.shape)
    mask = segment.mask[source]
    distance_m = _distance_m(depth_m[source], mask)

    shown = np.zeros((side, side, 4), np.float32)
    inside = shown[target]
    inside[..., :3] = colours(image[source]) * mask[..., None]
    inside[..., 3] = mask
    relief = np.zeros((side, side), np.float32)
    relief[target] = _relief(depth_m[source], distance_m)

    values = np.empty((CHANNELS, SIDE_PX, SIDE_PX), np.float32)
    values[:4] = _resized(shown).transpose(2, 0, 1)
    values[4] = _resized(relief)
    values[5] = _size_level(side * distance_m / focal_px)
    values[6:] = around[:, None, None]
    return values


def _size_level(side_m: float) -> float:
    """The length of a square's side, as the network receives it."""
    log_side = np.log(max(side_m, 1.0))
    return float(log_side / 2.0 - 1.0)


def _square(segment: Segment) -> tuple[int, int, int]:
    """The first column and row, and the side, of the square about `segment` with its margin, in
    pixels; parts of it may be outside the image.
    """
    left, top, width, height = segment.box_px
    longer = max(width, height)
    side = round(longer * (1 + 2 * MARGIN))
    half = side // 2

    middle_column = left + width // 2
    middle_row = top + height // 2
    return middle_column - half, middle_row - half, side


def _resized(square: Singles) -> Singles:
    """To SIDE_PX."""
    is_larger = len(square) > SIDE_PX
    interpolation = cv2.INTER_AREA if is_larger else cv2.INTER_LINEAR
    size = (SIDE_PX, SIDE_PX)

    resized = cv2.resize(square, size, interpolation=interpolation)
    return resized.astype(np.float32, copy=False)


def _distance_m(depth_m: Singles, mask: Booleans) -> float:
    """The median known depth within `mask`."""
    known = depth_m > 0
    own_m = depth_m[known & mask]
    if not len(own_m):
        return UNKNOWN_DISTANCE_M
    return float(np.median(own_m))


def _relief(depth_m: Singles, distance_m: float) -> Singles:
    """Log ratio of depth to `distance_m`, scaled and clipped to -1 to 1, 0 where unknown."""
    known = depth_m > 0
    filled_m = np.where(known, depth_m, distance_m)
    ratio = np.log(filled_m / distance_m)

    scaled = RELIEF * ratio
    return np.asarray(scaled.clip(-1, 1))


def _overlap(
    left: int, top: int, side: int, size: tuple[int, ...]
) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Of the square at `left`, `top`, the part inside an image of `size` (h, w): its rows and
    columns in the image, and in the square.
    """
    height, width = size
    rows, rows_in_square = _overlap_1d(top, side, height)
    columns, columns_in_square = _overlap_1d(left, side, width)
    return (rows, columns), (rows_in_square, columns_in_square)


def _overlap_1d(start: int, length: int, size: int) -> tuple[slice, slice]:
    first = max(start, 0)
    last = min(start + length, size)

    source = slice(first, last)
    target = slice(first - start, last - start)
    return source, target
