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

# One pixel in so many each way is used; its disparity's standard deviation.
STRIDE_PX = 4
DISPARITY_SD_PX = 0.3
# Disparity errors of neighbouring pixels are correlated: this many pixels count as one.
CORRELATED_PIXELS = 6.0
# Standard deviations of how nearly the camera is level, and at its mount's height.
ROLL_SD_RAD = 0.02
HEIGHT_SD_SHARE = 0.05
PITCH_SD_RAD = 0.02
# Disparities that misfit by more count for nothing: a limit for each round.
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
        """Return the disparity at each of these pixels; at most 0 at and over the horizon."""
        right, below = ray_slopes(rows, columns, camera)
        return self.across * right + self.down * below + self.level

    def disparity_image_px(self, size: tuple[int, ...], camera: Calibration) -> Floats:
        """Return the disparity at each pixel of an image of `size` (h, w)."""
        height, width = size
        rows = np.arange(height)[:, None]
        columns = np.arange(width)

        return self.disparity_px(rows, columns, camera)


def fit(mask: Booleans, disparity_px: Floats, camera: Calibration) -> GroundPlane:
    """Return the plane of the pixels in `mask` (h, w), by `disparity_px` (h, w), 0 unknown."""
    # One pixel in STRIDE_PX each direction.
    first = STRIDE_PX // 2
    every = slice(first, None, STRIDE_PX)
    sampled = np.nonzero(mask[every, every] & (disparity_px[every, every] > 0))
    rows, columns = (STRIDE_PX * number + first for number in sampled)
    right, below = ray_slopes(rows, columns, camera)
    slopes = np.stack([right, below, np.ones_like(right)], axis=1)

    # The plane below a level camera, and how much is known of it.
    down_px = focal_baseline(camera) / camera.mount_height_m
    prior = np.array([0.0, down_px, 0.0])
    sd = down_px * np.array([ROLL_SD_RAD, HEIGHT_SD_SHARE, PITCH_SD_RAD])
    information = np.diag(1 / sd**2)

    # Weighted least squares in excess of that, by Tukey's weights.
    observed_px = disparity_px[rows, columns] - slopes @ prior
    variance_px2 = CORRELATED_PIXELS * DISPARITY_SD_PX**2
    correction: Floats = np.zeros(3)
    for cutoff_px in CUTOFFS_PX:
        misfit_px = observed_px - slopes @ correction
        inlying = np.clip(1 - (misfit_px / cutoff_px) ** 2, 0.0, None)
        weighted = slopes.T * (inlying**2 / variance_px2)
        normal = weighted @ slopes + information
        correction = np.asarray(np.linalg.solve(normal, weighted @ observed_px))

    across, down, level = (prior + correction).tolist()
    return GroundPlane(across, down, level)


def focal_baseline(camera: Calibration) -> float:
    """Compute the product of a disparity in pixels and its depth in metres."""
    return camera.fx_px * camera.baseline_m


def ray_slopes(
    rows: npt.ArrayLike, columns: npt.ArrayLike, camera: Calibration
) -> tuple[Floats, Floats]:
    """Return the slopes of the pixels' rays to the right and downwards."""
    right = (np.asarray(columns, np.float64) - camera.cx_px) / camera.fx_px
    below = (np.asarray(rows, np.float64) - camera.cy_px) / camera.fy_px
    return right, below
