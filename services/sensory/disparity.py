"""Depth from stereo: semi-global matching (Hirschmüller 2008, OpenCV's StereoSGBM), then refined on
the images. Pure.

The matcher's cost ignores half a pixel (Birchfield and Tomasi 1998), so its disparities lean
towards whole pixels by up to 0.3: 8 % of the depth at 30 m. Gauss-Newton steps (Lucas and Kanade
1981) correct that.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.schemas.sensing import Calibration

# OpenCV's: disparities are in sixteenths of a pixel.
STEPS_PER_PIXEL = 16
# The matcher's block, and the most disparities that it tries: a bound on its time.
BLOCK_PX = 5
MAX_DISPARITIES = 256
# The largest disparity as a share of the width: 48 px of 320, 2.2 m with the town's camera.
NEAREST_SHARE = 0.15
# Differences of brightness above count as this much: OpenCV's least.
PREFILTER_CAP = 15
# Steps of the refinement, by what is in a window; the matcher leans by less than MAX_STEP_PX. These
# constants were chosen on 48 rendered views of towns 9911 to 9913.
WINDOW_PX = (9, 9)
REFINEMENTS = 2
MAX_STEP_PX = 0.3
# A window whose disparities differ by more shows several surfaces, not one that is slanted.
MAX_JUMP_PX = 4.0
# Less is no match: with the town's camera it would be farther than 400 m.
MIN_DISPARITY_PX = 0.25
# Added to the squared slope of brightness, so that noise alone moves little.
NOISE_GRADIENT = 4.0


class StereoMatcher:
    """Finds disparities up to `max_px`, rounded up to a multiple of 16, in rectified pairs of any
    size.
    """

    def __init__(self, max_px: float) -> None:
        self._disparities = max(16, 16 * math.ceil(max_px / 16))
        self._matcher = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=self._disparities,
            blockSize=BLOCK_PX,
            P1=8 * BLOCK_PX**2,
            P2=32 * BLOCK_PX**2,
            disp12MaxDiff=1,
            preFilterCap=PREFILTER_CAP,
            uniquenessRatio=5,
            speckleWindowSize=60,
            speckleRange=1,
            mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        )

    def disparity_px(self, left: Bytes, right: Bytes, refine: bool = True) -> Singles:
        """Return how far left each pixel of `left`, RGB (h, w, 3), is in `right`: float32 (h, w), 0
        for pixels without a sure match.
        """
        greys = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (left, right)]

        # The matcher leaves out a strip as wide as its search at the left border.
        padding = (0, 0, self._disparities, 0)
        padded = [cv2.copyMakeBorder(grey, *padding, cv2.BORDER_REPLICATE) for grey in greys]
        steps = self._matcher.compute(*padded)[:, self._disparities :]
        disparity_px: Singles = steps.astype(np.float32) / np.float32(STEPS_PER_PIXEL)
        if refine:
            grey_left, grey_right = (grey.astype(np.float32) for grey in greys)
            disparity_px = refined(disparity_px, grey_left, grey_right)

        is_unsure = (steps <= 0) | (disparity_px <= MIN_DISPARITY_PX)
        disparity_px[is_unsure] = 0.0
        return disparity_px


class DepthFromStereo:
    """Matches rectified pairs of one calibration, from infinity to about `nearest_m`, or to as near
    as NEAREST_SHARE of the width allows.
    """

    def __init__(self, calibration: Calibration, nearest_m: float = 0.0) -> None:
        self._focal_baseline = calibration.fx_px * calibration.baseline_m

        nearest_px = NEAREST_SHARE * calibration.width_px
        if nearest_m:
            nearest_px = self._focal_baseline / nearest_m
        max_px = min(nearest_px, MAX_DISPARITIES, calibration.width_px)
        self._matcher = StereoMatcher(max_px)

    def disparity_px(self, left: Bytes, right: Bytes, refine: bool = True) -> Singles:
        """Return what StereoMatcher does, float32 (h, w)."""
        return self._matcher.disparity_px(left, right, refine)

    def depth_m(self, left: Bytes, right: Bytes) -> Singles:
        """Return the depth along the optical axis of each pixel of `left`, float32 (h, w), 0 for
        those without a sure match.
        """
        return self.depth_of(self.disparity_px(left, right))

    def depth_of(self, disparity_px: Singles) -> Singles:
        """Return the depths of disparities, float32 (h, w), 0 where there is none."""
        focal_baseline = np.float32(self._focal_baseline)

        depth_m = np.zeros(disparity_px.shape, np.float32)
        np.divide(focal_baseline, disparity_px, out=depth_m, where=disparity_px > 0)

        return depth_m


def refined(disparity_px: Singles, left: Singles, right: Singles) -> Singles:
    """Return the disparities near `disparity_px` at which `left` and the shifted `right`, both
    grey, differ least around each pixel.

    Brightness is compared without its local mean, since two cameras seldom agree on it. A window
    moves as a whole: where it shows more than one surface, or a part without a match, the disparity
    of its middle stays as it is. So it does where the windows then differ no less.
    """
    height_px, width_px = disparity_px.shape
    columns, rows = np.meshgrid(
        np.arange(width_px, dtype=np.float32), np.arange(height_px, dtype=np.float32)
    )
    # The change of brightness by column.
    left_slope, right_slope = (
        cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8) for grey in (left, right)
    )
    min_px = disparity_px - MAX_STEP_PX
    max_px = disparity_px + MAX_STEP_PX

    def errors(matched: Singles) -> Singles:
        """Return how much brighter `right` is at those columns than `left`, less the mean."""
        error = cv2.remap(right, matched, rows, cv2.INTER_LINEAR) - left
        return np.asarray(error - cv2.boxFilter(error, -1, WINDOW_PX), np.float32)

    first_error = errors(columns - disparity_px)
    error = first_error
    result_px = disparity_px
    for _ in range(REFINEMENTS):
        matched = columns - result_px
        matched_slope = cv2.remap(right_slope, matched, rows, cv2.INTER_LINEAR)

        slope = 0.5 * (left_slope + matched_slope)
        curvature = cv2.boxFilter(slope * slope, -1, WINDOW_PX) + NOISE_GRADIENT
        step_px = cv2.boxFilter(slope * error, -1, WINDOW_PX) / curvature
        result_px = np.clip(result_px + step_px, min_px, max_px)
        error = errors(columns - result_px)

    window = np.ones(WINDOW_PX, np.uint8)
    jump_px = cv2.dilate(disparity_px, window) - cv2.erode(disparity_px, window)
    gain = cv2.boxFilter(first_error * first_error - error * error, -1, WINDOW_PX)
    is_refined = (jump_px <= MAX_JUMP_PX) & (gain > 0)
    return np.where(is_refined, result_px, disparity_px)
