"""Corners of a view, tracked to where the view before showed them. Pure.

The last view is redrawn as it should look now, by the depth of the new view and a guess of the
motion. Corners are tracked between the two, which look alike, so that no patch is stretched by
coming nearer: stretched ones are found too near to where they were.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cogmap.geometry.arrays import Booleans, Bytes, Floats, Singles

# Corners that are looked for, how good compared with the best, and how far apart, as a share of the
# width: 7 px of 320.
CORNERS = 240
MIN_QUALITY = 0.01
SPACING = 0.022
MIN_SPACING_PX = 3.0
# Lucas and Kanade's tracker (OpenCV's): its window and pyramid reach some 40 px from a guess.
WINDOW_PX = (11, 11)
LEVELS = 3
STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.02)
# A track that does not return to where it came from within this is none.
MAX_RETURN_PX = 0.5
# The width at which whole views are compared.
SMALL_PX = 160
# Views whose brightness differs by more than this share in one of so many bands are evened before
# corners are tracked between them: a camera's exposure changed, or it rolls while a lamp flickers.
# Evened images have more noise, so others are not.
SAME_EXPOSURE = 0.2
BANDS = 8
EVENED_PX = (31, 31)
EVENED_CONTRAST = 100.0
DARK_LEVEL = 8.0


def corners(grey: Bytes) -> Singles:
    """Return the pixels, column and row (n, 2), of the best corners of an image (h, w)."""
    spacing_px = max(MIN_SPACING_PX, SPACING * grey.shape[1])
    found = cv2.goodFeaturesToTrack(grey, CORNERS, MIN_QUALITY, spacing_px)
    if found is None:
        return np.zeros((0, 2), np.float32)
    return np.asarray(found, np.float32).reshape(-1, 2)


def seen_turn_rad(last: Bytes, new: Bytes, focal_px: float) -> float:
    """Return by what turn to the left a view (h, w) is most like the last one, if it does nothing
    else (phase correlation, OpenCV's).
    """
    scale = min(1.0, SMALL_PX / new.shape[1])
    small = [
        cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        for image in (last, new)
    ]
    height_px, width_px = small[0].shape
    window = cv2.createHanningWindow((width_px, height_px), cv2.CV_32F)
    first, second = (image.astype(np.float32) for image in small)
    (right_px, _), _ = cv2.phaseCorrelate(first, second, window)
    return math.atan2(right_px / scale, focal_px)


def is_exposed_alike(one: Bytes, other: Bytes) -> bool:
    """Return whether two images (h, w) are of one brightness, from top to bottom."""
    bands = [
        cv2.resize(image, (1, BANDS), interpolation=cv2.INTER_AREA).astype(np.float64) + 1
        for image in (one, other)
    ]
    return float(np.abs(np.log(bands[0] / bands[1])).max()) < SAME_EXPOSURE


def evened(grey: Bytes) -> Bytes:
    """Return an image (h, w) without what exposure changes: each pixel beside the mean around it,
    as a ratio.
    """
    logarithm = np.log(grey.astype(np.float32) + DARK_LEVEL)
    beside = logarithm - cv2.boxFilter(logarithm, -1, EVENED_PX)
    return np.asarray(np.clip(128 + EVENED_CONTRAST * beside, 0, 255), np.uint8)


def redrawn(last: Bytes, disparity_px: Singles, before: Floats) -> tuple[Bytes, Singles]:
    """Return the last view (h, w) as it should look now, and where it showed each pixel (h, w, 2).

    `before` (4, 4) maps columns, rows and disparities of the new view to those of the last one, up
    to scale. What has no disparity is redrawn as if it were infinitely far.
    """
    height_px, width_px = last.shape
    now = np.empty((height_px, width_px, 3), np.float32)
    now[..., 0] = np.arange(width_px)
    now[..., 1] = np.arange(height_px)[:, None]
    now[..., 2] = disparity_px
    then = cv2.perspectiveTransform(now, before)
    at_px = np.ascontiguousarray(then[..., :2], np.float32)
    return np.asarray(_looked_up(last, at_px), np.uint8), at_px


def track_redrawn(
    new: Bytes, last: Bytes, at_px: Singles, pixels: Singles
) -> tuple[Singles, Booleans]:
    """Find where corners (n, 2) of the new view were in the last one, (n, 2), by that as `redrawn`
    returned it, and which of them were found (n,).
    """
    found_px, is_found = track(new, last, pixels, pixels)
    before_px = _looked_up(at_px, found_px[None])[0]

    height_px, width_px = new.shape
    is_inside = ((before_px >= 0) & (before_px <= (width_px - 1, height_px - 1))).all(axis=1)
    return np.asarray(before_px, np.float32), is_found & is_inside


def _looked_up(image: NDArray[Any], at_px: Singles) -> NDArray[Any]:
    """Return the values of an image at pixels (h, w, 2), those of its border beyond it."""
    return cv2.remap(
        image, at_px[..., 0], at_px[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )


def track(new: Bytes, last: Bytes, pixels: Singles, guess_px: Singles) -> tuple[Singles, Booleans]:
    """Find where `pixels` (n, 2) of the new image were in the last one, near `guess_px`, and which
    of them were found (n,): tracked there, and back again.
    """
    before_px, is_tracked = _flow(new, last, pixels, guess_px)
    back_px, is_back = _flow(last, new, before_px, pixels)
    error_px = np.hypot(*(back_px - pixels).T)
    return before_px, is_tracked & is_back & (error_px < MAX_RETURN_PX)


def _flow(one: Bytes, other: Bytes, pixels: Singles, guess_px: Singles) -> tuple[Singles, Booleans]:
    found_px, status, _ = cv2.calcOpticalFlowPyrLK(
        one,
        other,
        pixels,
        guess_px.copy(),
        winSize=WINDOW_PX,
        maxLevel=LEVELS,
        criteria=STEPS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    result_px: Singles = np.asarray(found_px, np.float32)
    height_px, width_px = other.shape
    is_inside = ((result_px >= 0) & (result_px <= (width_px - 1, height_px - 1))).all(axis=1)
    return result_px, np.asarray(status[:, 0], bool) & is_inside


def at_pixels(image: Singles, pixels: Singles) -> Singles:
    """Return the values (n,) of an image (h, w) at the nearest to each of `pixels` (n, 2)."""
    columns, rows = np.rint(pixels).astype(int).T
    return np.asarray(image[rows, columns], np.float32)
