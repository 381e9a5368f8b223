"""What of the ground is road, in metres: a mask of the image laid on the ground plane that the
depth image tells.

The disparity of a plane is linear in column and row. The plane is the likeliest one given the
disparities on the road, reweighted so that what does not fit counts for nothing (Beaton & Tukey
1974), and given that the camera stands about level at its mount's height, which decides where
little depth is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration

Floats = npt.NDArray[np.float64]
Depth = npt.NDArray[np.float32]
Likelihood = npt.NDArray[np.float32]
Points = npt.NDArray[np.float32]
FARTHEST_M = 15.0
CELL_M = 0.5
SAMPLE_EVERY_PX = 4
DISPARITY_SD_PX = 0.3
# Disparities of neighbours err alike: so many samples tell as much as one.
ALIKE_SAMPLES = 6.0
ROLL_SD_RAD = 0.02
HEIGHT_SD_SHARE = 0.05
PITCH_SD_RAD = 0.02
CUTOFFS_PX = (4.0, 2.0, 1.5, 1.5)
# So much nearer than the ground is not the ground, if more than specks of the image are.
UPRIGHT_PX = 3.0
UPRIGHT_SHARE = 0.02
_SPECK = np.ones((5, 3), np.uint8)
# How far from the end of the mask an upright thing that hides the rest is looked for: columns, rows
# above, rows below.
BESIDE_PX = 4
ABOVE_PX = 12
BELOW_PX = 2
STANDS_SHARE = 0.93
STANDS_PX = 0.3
BORDER_PX = 3


@dataclass(frozen=True)
class Plane:
    """The disparity of the ground, in pixels: `across` a column's slope and `down` a row's slope,
    plus `level`.

    Slopes are those of the rays: (column - cx) / fx and (row - cy) / fy.
    """

    across: float
    down: float
    level: float

    def disparity_px(
        self, rows: npt.ArrayLike, columns: npt.ArrayLike, camera: Calibration
    ) -> Floats:
        """At each of these pixels; 0 or less at and over the horizon."""
        right, below = _slopes(rows, columns, camera)
        return self.across * right + self.down * below + self.level


def project(likelihood: Likelihood, depth_m: Depth, camera: Calibration) -> tuple[Points, Points]:
    """The road, and where it ends, as ground points in the robot's frame, x forward, y left,
    float32 (n, 2) each.

    `likelihood` and `depth_m` are (h, w); a pixel is road where its likelihood is 0.5 or more, and
    the road ends between pixels, where it would be 0.5. Both are within FARTHEST_M and thinned to
    the mean point in each cell of CELL_M. Where the image ends, or something upright hides what is
    behind it, no road ends.
    """
    disparity = np.divide(
        _focal_baseline(camera), depth_m, out=np.zeros(depth_m.shape), where=depth_m > 0
    )
    likelihood = likelihood.astype(np.float32, copy=False)
    mask = likelihood >= 0.5
    plane = fit(mask, disparity, camera)
    height, width = mask.shape
    ground = plane.disparity_px(np.arange(height)[:, None], np.arange(width), camera)
    above = disparity - np.maximum(ground, 0.0) > UPRIGHT_PX + UPRIGHT_SHARE * disparity
    upright = cv2.morphologyEx(above.astype(np.uint8), cv2.MORPH_OPEN, _SPECK) > 0
    road = np.nonzero(mask & ~upright & (ground > _focal_baseline(camera) / FARTHEST_M))
    ends = _ends(likelihood, mask, np.where(upright, disparity, 0.0).astype(np.float32), ground)
    return tuple(
        thinned(_on_ground(rows, columns, plane, camera)) for rows, columns in (road, ends)
    )  # type: ignore[return-value]


def fit(mask: npt.NDArray[np.bool_], disparity_px: Floats, camera: Calibration) -> Plane:
    """The plane of what `mask` (h, w) shows, from `disparity_px` (h, w), 0 unknown."""
    every = (slice(SAMPLE_EVERY_PX // 2, None, SAMPLE_EVERY_PX),) * 2
    rows, columns = np.nonzero(mask[every] & (disparity_px[every] > 0))
    rows, columns = (SAMPLE_EVERY_PX * at + SAMPLE_EVERY_PX // 2 for at in (rows, columns))
    right, below = _slopes(rows, columns, camera)
    slopes = np.stack([right, below, np.ones_like(right)], axis=1)
    down = _focal_baseline(camera) / camera.mount_height_m
    level = np.array([0.0, down, 0.0])
    stiffness = np.diag(1 / (down * np.array([ROLL_SD_RAD, HEIGHT_SD_SHARE, PITCH_SD_RAD])) ** 2)
    seen = disparity_px[rows, columns] - slopes @ level
    correction = np.zeros(3)
    for cutoff_px in CUTOFFS_PX:
        misfit = (seen - slopes @ correction) / cutoff_px
        weight = np.clip(1 - misfit**2, 0.0, None) ** 2 / (ALIKE_SAMPLES * DISPARITY_SD_PX**2)
        weighted = slopes.T * weight
        correction = np.linalg.solve(weighted @ slopes + stiffness, weighted @ seen)
    across, down, ahead = (level + correction).tolist()
    return Plane(across, down, ahead)


def _focal_baseline(camera: Calibration) -> float:
    return camera.fx_px * camera.baseline_m


def _slopes(
    rows: npt.ArrayLike, columns: npt.ArrayLike, camera: Calibration
) -> tuple[Floats, Floats]:
    right = (np.asarray(columns, np.float64) - camera.cx_px) / camera.fx_px
    return right, (np.asarray(rows, np.float64) - camera.cy_px) / camera.fy_px


def _ends(
    likelihood: Likelihood, mask: npt.NDArray[np.bool_], upright_px: Depth, ground_px: Floats
) -> tuple[Floats, Floats]:
    """Rows and columns, fractional, where the road in the image ends on the ground."""
    kernel = np.ones((ABOVE_PX + 1 + BELOW_PX, 2 * BESIDE_PX + 1), np.uint8)
    nearest = cv2.dilate(upright_px, kernel, anchor=(BESIDE_PX, ABOVE_PX))
    open_ground = (ground_px > 0) & (nearest < STANDS_SHARE * ground_px - STANDS_PX)
    rows, columns = np.nonzero(
        open_ground[:, :-1] & open_ground[:, 1:] & (mask[:, :-1] != mask[:, 1:])
    )
    beside = rows, columns + _crossing(likelihood[rows, columns], likelihood[rows, columns + 1])
    rows, columns = np.nonzero(open_ground[:-1] & open_ground[1:] & (mask[:-1] != mask[1:]))
    above = rows + _crossing(likelihood[rows, columns], likelihood[rows + 1, columns]), columns
    all_rows, all_columns = (
        np.concatenate(parts).astype(np.float64) for parts in zip(beside, above, strict=True)
    )
    height, width = mask.shape
    inside = (np.abs(all_rows - (height - 1) / 2) < (height - 1) / 2 - BORDER_PX) & (
        np.abs(all_columns - (width - 1) / 2) < (width - 1) / 2 - BORDER_PX
    )
    return all_rows[inside], all_columns[inside]


def _crossing(first: Likelihood, second: Likelihood) -> Likelihood:
    """How far from the first of two neighbours to the second, 0 to 1, the likelihood is 0.5."""
    return np.asarray((0.5 - first) / (second - first), np.float32)


def _on_ground(
    rows: npt.ArrayLike, columns: npt.ArrayLike, plane: Plane, camera: Calibration
) -> Floats:
    """The points (n, 2) of the ground that these pixels show; those at the horizon are left out."""
    disparity = plane.disparity_px(rows, columns, camera)
    below = disparity > _focal_baseline(camera) / FARTHEST_M
    ahead_m = _focal_baseline(camera) / disparity[below]
    right, _ = _slopes(rows, columns, camera)
    return np.stack([ahead_m + camera.mount_forward_m, -right[below] * ahead_m], axis=1)


def thinned(points: Floats) -> Points:
    """The mean of the points in each cell, in order of the cells."""
    near = points[np.hypot(points[:, 0], points[:, 1]) <= FARTHEST_M]
    reach = round(FARTHEST_M / CELL_M) + 1
    cells = np.floor(near / CELL_M).astype(np.intp) + reach
    cell = cells[:, 0] * 2 * reach + cells[:, 1]
    count = np.bincount(cell, minlength=1)
    kept = np.flatnonzero(count)
    sums = np.stack(
        [np.bincount(cell, near[:, axis], minlength=1)[kept] for axis in (0, 1)], axis=1
    )
    return np.asarray(sums / count[kept, None], np.float32)
