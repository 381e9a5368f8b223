"""The walls of a segment: the disparity of each of its columns, and whether the object truly ends
where the segment does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.footprint_fit import ObjectPose, Silhouette
from cogmap.services.epam.recognition.segments import Segment

MIN_PIXELS = 4
MIN_COLUMNS = 3
BESIDE_PX = 4
WITHIN_PX = 3
NEARER_PX = 0.3
MIXED_PX = 2
MIXED_WHERE_HIDDEN_PX = 5
USUAL_HALF_M = 4.5
USUAL_SD_M = 1.5
MIN_DISPARITY_PX = 0.5
MAX_RANGE_M = 400.0


@dataclass(frozen=True, eq=False)
class Walls:
    """Columns (n,) of the view with their disparity in pixels (n,), the first and last column of
    the segment, and whether the object truly begins and ends there.
    """

    columns: Floats
    disparity_px: Floats
    left: float
    right: float
    left_true: bool
    right_true: bool

    @property
    def whole(self) -> bool:
        """Whether neither the image's border nor another object cuts the object."""
        return self.left_true and self.right_true

    def silhouette(self, sides_m: tuple[float, float]) -> Silhouette:
        """Return the input of a footprint's fit, without the columns at each end whose depth mixes
        two objects.

        Depth spreads from what is nearer over what it hides, so more columns are left out where the
        object is hidden.
        """
        first = self._mixed_columns(self.left_true)
        last = len(self.columns) - self._mixed_columns(self.right_true)
        columns = self.columns[first:last]
        disparity_px = self.disparity_px[first:last]

        # Left of its disparity, a column is outside the right camera's image.
        matched = columns >= disparity_px
        if matched.sum() >= MIN_COLUMNS:
            columns = columns[matched]
            disparity_px = disparity_px[matched]

        return Silhouette(
            columns=columns,
            disparity_px=disparity_px,
            left=self.left,
            right=self.right,
            left_true=self.left_true,
            right_true=self.right_true,
            sides_m=sides_m,
        )

    def _mixed_columns(self, end_is_true: bool) -> int:
        mixed = MIXED_PX if end_is_true else MIXED_WHERE_HIDDEN_PX
        spare = (len(self.columns) - MIN_COLUMNS) // 2
        return max(0, min(mixed, spare))

    def usual_pose(self, camera: Calibration) -> ObjectPose:
        """Return the pose of a building of the usual size, behind the middle of what is seen."""
        forward_m, left_m = self._middle_m(camera)
        wall_m = float(np.hypot(forward_m, left_m))
        range_m = min(wall_m + USUAL_HALF_M, MAX_RANGE_M)
        hidden_m = 0.0 if self.whole else USUAL_HALF_M / 2
        lateral_sd_m = 0.1 * self.width_m(camera) + hidden_m + 0.3

        return ObjectPose(
            bearing_rad=float(np.arctan2(left_m, forward_m)),
            range_m=range_m,
            bearing_sd_rad=float(lateral_sd_m / range_m),
            range_sd_m=float(np.hypot(USUAL_SD_M, 0.05 * range_m)),
            misfit=0.0,
        )

    def _middle_m(self, camera: Calibration) -> tuple[float, float]:
        """The middle of what is seen, forward and left of the robot."""
        median_px = float(np.median(self.disparity_px))
        safe_px = max(median_px, MIN_DISPARITY_PX)
        depth_m = camera.fx_px * camera.baseline_m / safe_px
        forward_m = depth_m + camera.mount_forward_m

        middle_px = (self.left + self.right) / 2
        slope = (camera.cx_px - middle_px) / camera.fx_px
        return forward_m, slope * depth_m

    def width_m(self, camera: Calibration) -> float:
        """Return the distance between the first and the last column."""
        ends_px = self.disparity_px[[0, -1]].clip(MIN_DISPARITY_PX)
        forward_m = camera.fx_px * camera.baseline_m / ends_px

        columns_px = np.array([self.left, self.right])
        slopes = (columns_px - camera.cx_px) / camera.fx_px
        right_m = slopes * forward_m

        width_m = np.hypot(np.ptp(right_m), np.ptp(forward_m))
        return float(min(width_m, MAX_RANGE_M))


def walls(segment: Segment, disparity_px: Singles) -> Walls | None:
    """Return the walls of `segment`, where `disparity_px` (h, w) is that of the view, 0 unknown, or
    None if too few columns have a known disparity.
    """
    left, _, width, _ = segment.box_px
    span = slice(left, left + width)
    own = segment.mask[:, span]
    own_px = np.where(own, disparity_px[:, span], 0.0)
    medians_px = _column_medians(own_px)

    known = np.flatnonzero(medians_px)
    if len(known) < MIN_COLUMNS:
        return None

    return Walls(
        columns=(known + left).astype(np.float64),
        disparity_px=medians_px[known].astype(np.float64),
        left=left - 0.5,
        right=left + width - 0.5,
        left_true=_truly_ends(segment, disparity_px, medians_px, outward=-1),
        right_true=_truly_ends(segment, disparity_px, medians_px, outward=1),
    )


def _column_medians(values: Singles) -> Singles:
    """The upper median of the positive values in each column of (h, w), 0 where there are fewer
    than MIN_PIXELS.
    """
    height, width = values.shape
    is_known = values > 0
    count = is_known.sum(0)
    above_median = np.maximum(count - 1, 0) // 2

    # The unknown ones are 0 and come first.
    ascending = np.sort(values, axis=0)
    row = height - 1 - above_median
    medians = ascending[row, np.arange(width)]

    enough = count >= MIN_PIXELS
    return np.where(enough, medians, 0.0).astype(np.float32)


def _truly_ends(segment: Segment, disparity_px: Singles, medians_px: Singles, outward: int) -> bool:
    """Whether the object itself ends on that side (-1 left, 1 right), and is neither hidden by
    something nearer nor cut by the view.

    On the left, the view ends where the right camera's does: as many columns in as the disparity.
    """
    left, _, width, _ = segment.box_px
    last = width - 1

    within = min(WITHIN_PX, last)
    inside = last - within if outward > 0 else within
    edge = left + last if outward > 0 else left
    beyond = edge + BESIDE_PX * outward

    own_px = medians_px[inside]
    is_in_view = 0 <= beyond < disparity_px.shape[1]
    if not is_in_view or beyond < own_px:
        return False

    rows = segment.mask[:, left + inside]
    return not _is_nearer(disparity_px[rows, beyond], own_px)


def _is_nearer(beside_px: Singles, own_px: float) -> bool:
    """Whether what is beside a wall, with disparities 0 where unknown, is nearer than the wall."""
    known_px = beside_px[beside_px > 0]
    if len(known_px) < MIN_PIXELS:
        return False

    neighbour_px = np.median(known_px)
    nearer_px = own_px + NEARER_PX
    return bool(neighbour_px > nearer_px)
