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

from cogmap.geometry.arrays import Bytes, Singles

# A thumbnail with a quarter of the camera's sides, its rows down to just below the middle; a cell's
# side in its pixels, a patch's in cells.
COLUMNS = 80
ROWS = 60
ROWS_ABOVE_HORIZON = 32
CELL = 4
PATCH = 4
SHIFTS = (-6, -4, -2, 0, 2, 4, 6)
UNSHIFTED = SHIFTS.index(0)
# Grey levels added before the logarithm, so that noise in the dark counts for little.
DARK_LEVEL = 8.0
# Standard deviations of log brightness: added to a patch's, so that a flat one does not show noise,
# and the least that counts. A view with fewer patches of that much has no descriptor.
FLAT_CONTRAST = 0.1
MIN_CONTRAST = 0.04
MIN_PATCHES = 3
# Steps of a code for a standard deviation: a byte holds four to either side.
LEVELS = 32.0
# Of the upper half of a view this share at least must be so near.
NEAR_M = 30.0
MIN_NEAR_SHARE = 0.06
CELL_ORIGINS = np.arange(SHIFTS[-1], COLUMNS - SHIFTS[-1] - CELL + 1, CELL)[: 4 * PATCH]
DESCRIPTOR_BYTES = (ROWS_ABOVE_HORIZON // CELL) * len(CELL_ORIGINS) * 3


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
    normalized = (patches - mean) / (contrast + np.float32(FLAT_CONTRAST))

    levels = np.rint(128 + LEVELS * normalized)
    codes = np.clip(levels, 0, 255).astype(np.uint8)
    return np.asarray(codes.reshape(len(SHIFTS), DESCRIPTOR_BYTES))


def _patches(image: Bytes) -> Singles:
    """Divide the cells of `image`, for each of SHIFTS and each channel, into patches of PATCH by
    PATCH cells: (shift, channel, row of patches, PATCH, column of patches, PATCH).
    """
    thumbnail = cv2.resize(image, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
    above = thumbnail[:ROWS_ABOVE_HORIZON].astype(np.float32)
    red, green, blue = np.moveaxis(np.log(above + np.float32(DARK_LEVEL)), 2, 0)

    # Mean log brightness, red-green and blue-green: a row for each cell, and a column for each of
    # the thumbnail's.
    channels = cv2.merge([(red + green + blue) / 3, red - green, blue - green])
    means = cv2.boxFilter(
        channels, -1, (CELL, CELL), anchor=(0, 0), borderType=cv2.BORDER_REPLICATE
    )
    cells = np.asarray(means[::CELL], np.float32)

    windows = cells[:, np.asarray(SHIFTS)[:, None] + CELL_ORIGINS]
    by_shift = windows.transpose(1, 3, 0, 2)
    return by_shift.reshape(len(SHIFTS), 3, -1, PATCH, len(CELL_ORIGINS) // PATCH, PATCH)


def has_near_structure(depth_m: Singles) -> bool:
    """Return true if enough above the horizon of a view with this depth (h, w) is near: distant
    hills identify no place.
    """
    above_m = depth_m[: len(depth_m) // 2]
    near = (above_m > 0) & (above_m < NEAR_M)
    return float(near.mean()) >= MIN_NEAR_SHARE


def unit_vectors(codes: Bytes) -> Singles:
    """Return `codes` (n, DESCRIPTOR_BYTES) as float32 vectors of length 1, whose inner product is
    the similarity of two views.
    """
    values = codes.astype(np.float32) - np.float32(128)
    length = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.maximum(length, np.float32(1)), np.float32)
