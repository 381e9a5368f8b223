"""Depth from stereo: semi-global matching (Hirschmüller 2008, OpenCV's StereoSGBM), then refined on
the images.

The matcher's cost does not care about half a pixel (Birchfield and Tomasi 1998), so its disparities
lean towards whole pixels by up to 0.3: 8 % of the depth at 30 m. Gauss-Newton steps (Lucas and
Kanade 1981) take that away.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.sensory.image import Bytes, Floats

STEPS_PER_PIXEL = 16
BLOCK_PX = 5
MOST_DISPARITIES = 256
WINDOW_PX = (9, 9)
REFINEMENTS = 2
FARTHEST_STEP_PX = 0.5
LEAST_PX = 0.25
NOISE_GRADIENT = 1.0


class StereoMatcher:
    """Finds disparities up to `most_px`, rounded up to a multiple of 16, in rectified pairs of any
    size.
    """

    def __init__(self, most_px: float) -> None:
        self._disparities = max(16, 16 * math.ceil(most_px / 16))
        self._matcher = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=self._disparities,
            blockSize=BLOCK_PX,
            P1=8 * BLOCK_PX**2,
            P2=32 * BLOCK_PX**2,
            disp12MaxDiff=1,
            preFilterCap=31,
            uniquenessRatio=5,
            speckleWindowSize=60,
            speckleRange=1,
            mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        )

    def disparity_px(self, left: Bytes, right: Bytes, refine: bool = True) -> Floats:
        """How far left each pixel of `left`, RGB (h, w, 3), is in `right`: float32 (h, w), 0 where
        no match is sure.

        The matcher leaves out a strip as wide as its search at the left border, so both images are
        padded there.
        """
        grey_left, grey_right = (cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (left, right))
        steps = self._matcher.compute(self._padded(grey_left), self._padded(grey_right))[
            :, self._disparities :
        ]
        disparity = steps.astype(np.float32) / np.float32(STEPS_PER_PIXEL)
        if refine:
            disparity = refined(disparity, _floats(grey_left), _floats(grey_right))
        disparity[(steps <= 0) | (disparity <= LEAST_PX)] = 0.0
        return disparity

    def _padded(self, grey: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return cv2.copyMakeBorder(grey, 0, 0, self._disparities, 0, cv2.BORDER_REPLICATE)


class DepthFromStereo:
    """Matches rectified pairs of one calibration, from infinity to `nearest_m` or a little nearer."""

    def __init__(self, calibration: Calibration, nearest_m: float) -> None:
        self._focal_baseline = calibration.fx_px * calibration.baseline_m
        most = min(MOST_DISPARITIES, calibration.width_px)
        self._matcher = StereoMatcher(min(self._focal_baseline / nearest_m, most))

    def depth_m(self, left: Bytes, right: Bytes) -> Floats:
        """Depth along the optical axis for each pixel of `left`, float32 (h, w), 0 where no match
        is sure.
        """
        disparity = self._matcher.disparity_px(left, right)
        depth = np.zeros(disparity.shape, np.float32)
        np.divide(np.float32(self._focal_baseline), disparity, out=depth, where=disparity > 0)
        return depth


def refined(disparity: Floats, left: Floats, right: Floats) -> Floats:
    """Disparity moved to where `left` and the shifted `right`, both grey, differ least around each
    pixel.

    Brightness is compared without its local mean, since two cameras seldom agree on it.
    """
    columns, rows = np.meshgrid(*(np.arange(n, dtype=np.float32) for n in disparity.shape[::-1]))
    left_slope, right_slope = (
        cv2.Sobel(grey, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8) for grey in (left, right)
    )
    result = disparity
    for _ in range(REFINEMENTS):
        there = columns - result
        slope = 0.5 * (left_slope + cv2.remap(right_slope, there, rows, cv2.INTER_LINEAR))
        error = cv2.remap(right, there, rows, cv2.INTER_LINEAR) - left
        error -= _local_mean(error)
        result = result + _local_mean(slope * error) / (_local_mean(slope * slope) + NOISE_GRADIENT)
        result = np.clip(result, disparity - FARTHEST_STEP_PX, disparity + FARTHEST_STEP_PX)
    return result


def _local_mean(values: Floats) -> Floats:
    return _floats(cv2.boxFilter(values, -1, WINDOW_PX))


def _floats(values: npt.NDArray[Any]) -> Floats:
    return values.astype(np.float32, copy=False)
