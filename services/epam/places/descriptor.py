"""A view as a short code that light hardly changes: brightness and colour of a thumbnail,
normalised by patch.

After SeqSLAM (Milford and Wyeth 2012), whose grey thumbnail this widens by two opponent colours.
Both are differences of logarithms: a lamp's or a camera's tint adds a constant to each, and a
shadow the same one to all colours, so that the opponents do not see it. Only what stands above the
horizon of a level camera is looked at: the ground is much the same everywhere, and shadows wander
over it.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
Depth = npt.NDArray[np.float32]
Code = npt.NDArray[np.uint8]
Vectors = npt.NDArray[np.float32]

COLUMNS = 80
ROWS = 60
ABOVE_ROWS = 32
CELL = 4
PATCH = 4
SHIFTS = (-6, -4, -2, 0, 2, 4, 6)
MIDDLE = SHIFTS.index(0)
DARK_LEVEL = 8.0
FLAT = 0.1
LEAST_CONTRAST = 0.04
FEWEST_PATCHES = 3
LEVELS = 32.0
NEAR_M = 30.0
LEAST_NEAR = 0.06
_ORIGINS = np.arange(SHIFTS[-1], COLUMNS - SHIFTS[-1] - CELL + 1, CELL)[: 4 * PATCH]
_COLUMNS = np.asarray(SHIFTS)[:, None] + _ORIGINS
CODE_BYTES = (ABOVE_ROWS // CELL) * len(_ORIGINS) * 3


def view_codes(image: Image) -> Code | None:
    """The codes of `image` (h, w, 3) as it is, at MIDDLE, and as a robot turned a little to each
    side would see it.

    uint8 (len(SHIFTS), CODE_BYTES); the farthest is turned by 24 columns of 320. None where there
    is nothing to see.
    """
    small = cv2.resize(image, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)[:ABOVE_ROWS]
    light = np.log(small.astype(np.float32) + np.float32(DARK_LEVEL))
    red = light[..., 0]
    green = light[..., 1]
    blue = light[..., 2]
    channels = cv2.merge([(red + green + blue) / 3, red - green, blue - green])
    cells = cv2.boxFilter(
        channels, -1, (CELL, CELL), anchor=(0, 0), borderType=cv2.BORDER_REPLICATE
    )
    windows = cells[::CELL][:, _COLUMNS].transpose(1, 3, 0, 2)
    patches = windows.reshape(len(SHIFTS), 3, -1, PATCH, len(_ORIGINS) // PATCH, PATCH)
    contrast = patches.std(axis=(3, 5), keepdims=True)
    if (contrast[MIDDLE, 0] > LEAST_CONTRAST).sum() < FEWEST_PATCHES:
        return None
    normal = (patches - patches.mean(axis=(3, 5), keepdims=True)) / (contrast + np.float32(FLAT))
    codes = np.clip(np.rint(128 + LEVELS * normal), 0, 255).astype(np.uint8)
    return np.asarray(codes.reshape(len(SHIFTS), CODE_BYTES))


def something_near(depth_m: Depth) -> bool:
    """Whether anything above the horizon of the view with this depth (h, w) is near: far hills tell
    no place.
    """
    above = depth_m[: len(depth_m) // 2]
    return float(((above > 0) & (above < NEAR_M)).mean()) >= LEAST_NEAR


def vectors(codes: Code) -> Vectors:
    """`codes` (n, CODE_BYTES) as float32 vectors of length 1, whose inner product is how alike two
    views are.
    """
    values = codes.astype(np.float32) - np.float32(128)
    length = np.linalg.norm(values, axis=1, keepdims=True)
    return np.asarray(values / np.maximum(length, np.float32(1)), np.float32)
