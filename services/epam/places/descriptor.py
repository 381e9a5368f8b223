"""A view's descriptor for place recognition, which light hardly changes: brightness and colour of a
thumbnail, normalized by patch.

After SeqSLAM (Milford and Wyeth 2012), whose grey thumbnail this extends by two opponent colours.
Both are differences of logarithms: the tint of a lamp or a camera adds a constant to each, and a
shadow the same one to all colours, so that the opponents are invariant to it. Only what is above
the horizon of a level camera is used: the ground is much the same everywhere, and shadows move over
it.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Bytes, Singles

COLUMNS = 80
ROWS = 60
ROWS_ABOVE_HORIZON = 32
CELL = 4
PATCH = 4
SHIFTS = (-6, -4, -2, 0, 2, 4, 6)
UNSHIFTED = SHIFTS.index(0)
DARK_LEVEL = 8.0
FLAT_CONTRAST = 0.1
MIN_CONTRAST = 0.04
MIN_PATCHES = 3
LEVELS = 32.0
NEAR_M = 30.0
MIN_NEAR_SHARE = 0.06
_ORIGINS = np.arange(SHIFTS[-1], COLUMNS - SHIFTS[-1] - CELL + 1, CELL)[: 4 * PATCH]
_COLUMNS = np.asarray(SHIFTS)[:, None] + _ORIGINS
DESCRIPTOR_BYTES = (ROWS_ABOVE_HORIZON // CELL) * len(_ORIGINS) * 3


def descriptors(image: Bytes) -> Bytes | None:
    """Return the descriptors of `image` (h, w, 3) as it is, at row UNSHIFTED, and as seen by a
    robot that is turned a little to each side.

    uint8 (len(SHIFTS), DESCRIPTOR_BYTES); the largest turn is 24 columns of 320. None if there is
    too little contrast.
    """
    patches = _patches(image)
    contrast = patches.std(axis=(3, 5), keepdims=True)
    of_brightness = contrast[UNSHIFTED, 0]
    if np.count_nonzero(of_brightness > MIN_CONTRAST) < MIN_PATCHES:
        return None

    mean = patches.mean(axis=(3, 5), keepdims=True)
    divisor = contrast + np.float32(FLAT_CONTRAST)
    normalized = (patches - mean) / divisor

    codes = _quantized(normalized)
    return codes.reshape(len(SHIFTS), DESCRIPTOR_BYTES)


def _patches(image: Bytes) -> Singles:
    """The cells of `image` for each of SHIFTS and each channel, in patches of PATCH by PATCH cells:
    (shift, channel, row of patches, PATCH, column of patches, PATCH).
    """
    windows = _cells(image)[:, _COLUMNS]
    by_shift = windows.transpose(1, 3, 0, 2)

    patches_across = len(_ORIGINS) // PATCH
    return by_shift.reshape(len(SHIFTS), 3, -1, PATCH, patches_across, PATCH)


def _quantized(normalized: npt.NDArray[np.floating]) -> Bytes:
    """Normalized values as bytes, LEVELS for each unit about 128."""
    levels = np.rint(128 + LEVELS * normalized)
    limited = np.clip(levels, 0, 255)
    return np.asarray(limited.astype(np.uint8))


def _cells(image: Bytes) -> Singles:
    """Mean log brightness, red-green and blue-green of the cells above the horizon, a row for each
    cell and a column for each of the thumbnail's.
    """
    thumbnail = cv2.resize(image, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
    above = thumbnail[:ROWS_ABOVE_HORIZON].astype(np.float32)
    light = np.log(above + np.float32(DARK_LEVEL))
    channels = _opponents(light)

    means = cv2.boxFilter(
        channels,
        -1,
        (CELL, CELL),
        anchor=(0, 0),
        borderType=cv2.BORDER_REPLICATE,
    )
    return np.asarray(means[::CELL], np.float32)


def _opponents(light: Singles) -> Singles:
    """The mean and two differences of the logarithms of red, green and blue, (h, w, 3)."""
    red, green, blue = np.moveaxis(light, 2, 0)

    brightness = (red + green + blue) / 3
    red_green = red - green
    blue_green = blue - green

    merged = cv2.merge([brightness, red_green, blue_green])
    return np.asarray(merged, np.float32)


def has_near_structure(depth_m: Singles) -> bool:
    """Return whether enough above the horizon of a view with this depth (h, w) is near: distant
    hills identify no place.
    """
    horizon = len(depth_m) // 2
    above_m = depth_m[:horizon]

    known = above_m > 0
    near = known & (above_m < NEAR_M)
    share = float(near.mean())
    return share >= MIN_NEAR_SHARE


def unit_vectors(codes: Bytes) -> Singles:
    """Return `codes` (n, DESCRIPTOR_BYTES) as float32 vectors of length 1, whose inner product is
    the similarity of two views.
    """
    middle = np.float32(128)
    values = codes.astype(np.float32) - middle

    length = np.linalg.norm(values, axis=1, keepdims=True)
    divisor = np.maximum(length, np.float32(1))

    vectors = values / divisor
    return np.asarray(vectors, np.float32)
