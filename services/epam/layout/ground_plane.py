"""The ground plane that a view's disparities show.

The disparity of a plane is linear in column and row. The plane is the likeliest one given the
disparities on the road, reweighted so that outliers count for nothing (Beaton & Tukey 1974), and
given that the camera is about level at its mount's height, which decides where little depth is
known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.schemas.sensing import Calibration

STRIDE_PX = 4
DISPARITY_SD_PX = 0.3
# Disparity errors of neighbouring pixels are correlated: this many pixels count as one.
CORRELATED_PIXELS = 6.0
ROLL_SD_RAD = 0.02
HEIGHT_SD_SHARE = 0.05
PITCH_SD_RAD = 0.02
CUTOFFS_PX = (4.0, 2.0, 1.5, 1.5)


@dataclass(frozen=True)
class GroundPlane:
    """The disparity of the ground, in pixels: `across` times a column's slope plus `down` times a
    row's slope plus `level`.

    Slopes are those of the rays: (column - cx) / fx and (row - cy) / fy.
    """

    across: float
    down: float
    level: float

    def disparity_px(
        self, rows: npt.ArrayLike, columns: npt.ArrayLike, camera: Calibration
    ) -> Floats:
        """The disparity at each of these pixels; at most 0 at and over the horizon."""
        right, below = ray_slopes(rows, columns, camera)

        across_px = self.across * right
        down_px = self.down * below
        return across_px + down_px + self.level

    def disparity_image_px(self, size: tuple[int, ...], camera: Calibration) -> Floats:
        """The disparity at each pixel of an image of `size` (h, w)."""
        height, width = size
        rows = np.arange(height)[:, None]
        columns = np.arange(width)

        return self.disparity_px(rows, columns, camera)


def fit(mask: Booleans, disparity_px: Floats, camera: Calibration) -> GroundPlane:
    """Return the plane of the pixels in `mask` (h, w), by `disparity_px` (h, w), 0 unknown."""
    rows, columns = _sampled_pixels(mask, disparity_px)
    right, below = ray_slopes(rows, columns, camera)
    slopes = np.stack([right, below, np.ones_like(right)], axis=1)

    prior, information = _prior(camera)
    predicted_px = slopes @ prior
    observed_px = disparity_px[rows, columns] - predicted_px

    correction = _correction(slopes, observed_px, information)
    across, down, level = (prior + correction).tolist()
    return GroundPlane(across, down, level)


def _prior(camera: Calibration) -> tuple[Floats, Floats]:
    """The coefficients (3,) of the plane below a level camera, and their information matrix."""
    down_px = focal_baseline(camera) / camera.mount_height_m
    coefficients = np.array([0.0, down_px, 0.0])

    relative_sd = np.array([ROLL_SD_RAD, HEIGHT_SD_SHARE, PITCH_SD_RAD])
    sd = down_px * relative_sd
    variance = sd**2
    information = np.diag(1 / variance)

    return coefficients, information


def _correction(slopes: Floats, observed_px: Floats, information: Floats) -> Floats:
    """What to add to the coefficients (3,) of the prior, by the disparities (n,) observed in excess
    of it along rays of these slopes (n, 3): weighted least squares, again for each of CUTOFFS_PX.
    """
    variance_px2 = CORRELATED_PIXELS * DISPARITY_SD_PX**2
    correction: Floats = np.zeros(3)
    for cutoff_px in CUTOFFS_PX:
        misfit_px = observed_px - slopes @ correction
        relative = misfit_px / cutoff_px
        weight = _biweight(relative) / variance_px2

        weighted = slopes.T * weight
        normal = weighted @ slopes + information
        solved = np.linalg.solve(normal, weighted @ observed_px)
        correction = np.asarray(solved)

    return correction


def _biweight(misfit: Floats) -> Floats:
    """Tukey's weight of residuals in units of the cutoff."""
    inlying = np.clip(1 - misfit**2, 0.0, None)
    return np.asarray(inlying**2)


def focal_baseline(camera: Calibration) -> float:
    """Disparity in pixels times depth in metres."""
    return camera.fx_px * camera.baseline_m


def ray_slopes(
    rows: npt.ArrayLike, columns: npt.ArrayLike, camera: Calibration
) -> tuple[Floats, Floats]:
    """The slopes of the pixels' rays to the right and downwards."""
    right_px = np.asarray(columns, np.float64) - camera.cx_px
    right = right_px / camera.fx_px

    below_px = np.asarray(rows, np.float64) - camera.cy_px
    below = below_px / camera.fy_px
    return right, below


def _sampled_pixels(
    mask: Booleans, disparity_px: Floats
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows and columns of the pixels in `mask` with a known disparity, one in STRIDE_PX each
    direction.
    """
    first = STRIDE_PX // 2
    every = slice(first, None, STRIDE_PX)

    wanted = mask[every, every]
    known = disparity_px[every, every] > 0

    numbers = np.nonzero(wanted & known)
    rows, columns = (STRIDE_PX * number + first for number in numbers)
    return rows, columns
