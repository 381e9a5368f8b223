"""Whether the two images of a pair belong together: taken at once, each by its own camera, and as
calibrated. Pure.

In a rectified pair a point is in the same row of both. How far corners lie off their rows says how
much depth is worth; a late image shows them where the robot's motion had them before.
"""

from __future__ import annotations

import enum
from collections.abc import Callable

import cv2
import numpy as np

from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.sensory.disparity import BLOCK_PX
from cogmap.services.sensory.self_motion.tracks import at_pixels, track

# With fewer corners nothing can be said. In a pair that belongs together most of them match: where
# fewer than MIN_MATCHED do, something else is tried. Exchanged, images match by so much more.
MIN_CORNERS = 20
MIN_MATCHED = 0.7
MIN_GAIN = 0.2
# A right image in which so few corners are found shows something else.
MIN_FOUND = 0.25
# Off their rows, by the median: the matcher, whose blocks are 5 px high, hardly minds the first;
# beyond the second, if nothing explains it, depth is wrong.
SUSPECT_PX = 0.6
MAX_OFF_ROW_PX = 1.0
# An image is late if rows differ by that share, at least, of what moved since the last view, and
# that explains so much of it. On KITTI's pairs the share was 0.02, and 0.46 to 0.98 if the right
# image was one or two frames late.
MIN_LATE_SHARE = 0.25
MIN_MOVED_PX = 0.4
MIN_EXPLAINED = 0.4
# An image of less contrast shows nothing.
MIN_CONTRAST = 16
# The ends of a sensor's range, less its noise.
BRIGHT = 254
DARK = 1


class PairFault(enum.StrEnum):
    """What is wrong with a pair, and what to do about it."""

    NONE = ""
    REPEATED = (
        "the right image is that of the frame before, the left one is new: give both cameras one "
        "trigger"
    )
    SWAPPED = "left and right are swapped: exchange the cameras' names"
    LATE = "left and right were not taken at the same time: give both cameras one trigger"
    OFF_ROWS = (
        "left and right do not lie as calibrated, their points are off their rows: calibrate the "
        "cameras again"
    )
    UNLIKE = "the right image does not show what the left one does: see whether it is covered"


class PairCheck:
    """Checks each pair, and remembers the last one."""

    def __init__(self) -> None:
        nothing = np.empty((0, 0), np.uint8)
        self._pair: tuple[Bytes, Bytes] = (nothing, nothing)

    def fault(
        self,
        left: Bytes,
        right: Bytes,
        pixels: Singles,
        disparity_px: Singles,
        exchanged: Callable[[], Singles],
    ) -> PairFault:
        """Return what is wrong with a grey pair (h, w), by the corners (n, 2) of its left image and
        its disparities (h, w). `exchanged` returns those that it has the other way round.
        """
        last: Bytes | None = None
        if self._pair[0].shape == left.shape:
            last, last_right = self._pair
            is_new = bool((last != left).any())
            has_content = int(right.max()) - int(right.min()) > MIN_CONTRAST
            if is_new and has_content and (last_right == right).all():
                self._pair = (left, right)
                return PairFault.REPEATED

        self._pair = (left, right)
        if len(pixels) < MIN_CORNERS:
            return PairFault.NONE
        at_corners_px = at_pixels(disparity_px, pixels)
        is_matched = at_corners_px > 0
        if is_matched.mean() < MIN_MATCHED:
            otherwise = at_pixels(exchanged(), pixels) > 0
            if otherwise.mean() > is_matched.mean() + MIN_GAIN:
                return PairFault.SWAPPED

        return self._off_rows(pixels[is_matched], at_corners_px[is_matched], len(pixels), last)

    def _off_rows(
        self, pixels: Singles, disparity_px: Singles, corners: int, last: Bytes | None
    ) -> PairFault:
        """Judge by how far the matched corners (n, 2) of `corners` lie off their rows, and by how
        far they have moved in the left image since the last one.
        """
        if len(pixels) < MIN_FOUND * corners:
            return PairFault.UNLIKE

        left, right = self._pair
        guess_px = pixels.copy()
        guess_px[:, 0] -= disparity_px
        found_px, is_found = track(left, right, pixels, guess_px)
        if is_found.sum() < MIN_FOUND * corners:
            return PairFault.UNLIKE

        found = pixels[is_found]
        off_px = found_px[is_found, 1] - found[:, 1]
        typical_px = float(np.median(np.abs(off_px)))
        if typical_px < SUSPECT_PX:
            return PairFault.NONE

        if last is not None:
            before_px, is_tracked = track(left, last, found, found)
            moved_px = (before_px - found)[is_tracked, 1]
            if _is_late(off_px[is_tracked], moved_px):
                return PairFault.LATE
        return PairFault.OFF_ROWS if typical_px > MAX_OFF_ROW_PX else PairFault.NONE


def _is_late(off_px: Singles, moved_px: Singles) -> bool:
    """Return whether corners are off their rows (n,) as the motion has moved them (n,)."""
    moved = float(moved_px @ moved_px)
    off = float(off_px @ off_px)
    both = float(off_px @ moved_px)
    if moved <= MIN_MOVED_PX**2 * len(moved_px) or off <= 0:
        return False
    return abs(both) > MIN_LATE_SHARE * moved and both**2 > MIN_EXPLAINED * moved * off


def is_clipped(grey: Bytes) -> Booleans:
    """Return where an image (h, w) is over- or under-exposed all around a pixel, so that nothing
    there can be matched.
    """
    block = np.ones((BLOCK_PX, BLOCK_PX), np.uint8)
    bright = cv2.erode((grey >= BRIGHT).astype(np.uint8), block)
    dark = cv2.erode((grey <= DARK).astype(np.uint8), block)
    return np.asarray((bright > 0) | (dark > 0), bool)
