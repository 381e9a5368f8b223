"""A segment as the network sees it that names and describes it.

What colour a wall seems to have depends on the light. So the network is told besides the segment
what colour the ground and the sky have in the same light, and can learn to allow for that (colour
constancy).
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.network import Tensor
from services.epam.recognition.segments import Depth, Image, Segment

SIDE_PX = 48
CHANNELS = 12
MARGIN = 0.04
UNKNOWN_DISTANCE_M = 30.0
RELIEF = 4.0
GROUND_M = 0.3
FEWEST_PX = 12
EVERY = 2


def surroundings(image: Image, depth_m: Depth, camera: Calibration) -> Tensor:
    """The usual colour of the ground and of the sky, as `colours`, float32 (6,): 0 for what is not
    in view.

    The sky is what has no depth, above the horizon.
    """
    image = image[::EVERY, ::EVERY]
    depth_m = depth_m[::EVERY, ::EVERY]
    rows = EVERY * np.arange(depth_m.shape[0], dtype=np.float32)[:, None]
    down = (rows - np.float32(camera.cy_px)) / np.float32(camera.fy_px)
    ground = (depth_m > 0) & (down > 0) & (camera.mount_height_m - down * depth_m < GROUND_M)
    sky = (depth_m == 0) & (down < 0)
    return np.concatenate([_usual(image[where]) for where in (ground, sky)])


def _usual(pixels: Image) -> Tensor:
    return (
        colours(np.median(pixels, axis=0)) if len(pixels) >= FEWEST_PX else np.zeros(3, np.float32)
    )


def colours(levels: npt.ArrayLike) -> Tensor:
    """Levels of 255 as the network sees them."""
    return np.asarray(levels, np.float32) / 64.0 - 2.0


def crop(image: Image, depth_m: Depth, segment: Segment, around: Tensor, focal_px: float) -> Tensor:
    """`segment`, float32 (CHANNELS, SIDE_PX, SIDE_PX): three colours, 0 where it is not; where it
    is; how much farther than it each part of the picture is; how many metres that is high, as a
    logarithm; and its surroundings.
    """
    left, top, wide, high = segment.box_px
    side = round(max(wide, high) * (1 + 2 * MARGIN))
    span, into = _square(
        left + wide // 2 - side // 2, top + high // 2 - side // 2, side, depth_m.shape
    )
    mask = segment.mask[span]
    known = depth_m[span] > 0
    own = depth_m[span][known & mask]
    distance_m = float(np.median(own)) if len(own) else UNKNOWN_DISTANCE_M
    square = np.zeros((side, side, 4), np.float32)
    relief = np.zeros((side, side), np.float32)
    square[*into, :3] = colours(image[span]) * mask[..., None]
    square[*into, 3] = mask
    relief[into] = (RELIEF * np.log(np.where(known, depth_m[span], distance_m) / distance_m)).clip(
        -1, 1
    )
    how = cv2.INTER_AREA if side > SIDE_PX else cv2.INTER_LINEAR
    values = np.empty((CHANNELS, SIDE_PX, SIDE_PX), np.float32)
    values[:4] = cv2.resize(square, (SIDE_PX, SIDE_PX), interpolation=how).transpose(2, 0, 1)
    values[4] = cv2.resize(relief, (SIDE_PX, SIDE_PX), interpolation=how)
    values[5] = np.log(max(side * distance_m / focal_px, 1.0)) / 2.0 - 1.0
    values[6:] = around[:, None, None]
    return values


def _square(
    left: int, top: int, side: int, size: tuple[int, ...]
) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Of the square at `left`, `top` that part which is inside an image of `size`: where there, and
    where in it.
    """
    first = max(top, 0), max(left, 0)
    last = min(top + side, size[0]), min(left + side, size[1])
    span = slice(first[0], last[0]), slice(first[1], last[1])
    into = slice(first[0] - top, last[0] - top), slice(first[1] - left, last[1] - left)
    return span, into
