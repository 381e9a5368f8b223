"""The walls of a segment: the disparity of each of its columns, and whether the object truly ends
at the segment's ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.footprint_fit import ObjectPose, Silhouette, bias_sd_px
from cogmap.services.epam.recognition.segments import Segment

# A column with fewer known pixels has no disparity; a segment with fewer such columns has no walls.
MIN_PIXELS = 4
MIN_COLUMNS = 3
# An end of a segment is compared from so many columns within to so many beyond it; something beyond
# with a disparity that is larger by more than NEARER_PX hides the rest.
WITHIN_PX = 3
BESIDE_PX = 4
NEARER_PX = 0.3
# Columns at a true and at a hidden end whose depth mixes two objects: depth spreads from the nearer
# object over the one that it hides.
MIXED_PX = 2
MIXED_AT_HIDDEN_END_PX = 5
# Half the side of a building of unknown size, as the simulator's catalogue has them, and its
# standard deviation.
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
        """Return whether neither the image's border nor another object cuts the object."""
        return self.left_true and self.right_true

    @property
    def middle(self) -> float:
        """Return the column in the middle of the segment."""
        return (self.left + self.right) / 2

    def silhouette(
        self, sides_m: tuple[float, float], sides_sd_m: tuple[float, float]
    ) -> Silhouette:
        """Return the input of a footprint's fit, without the columns at each end whose depth mixes
        two objects.
        """
        spare = (len(self.columns) - MIN_COLUMNS) // 2
        mixed = [
            max(0, min(MIXED_PX if end_is_true else MIXED_AT_HIDDEN_END_PX, spare))
            for end_is_true in (self.left_true, self.right_true)
        ]
        first = mixed[0]
        last = len(self.columns) - mixed[1]
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
            sides_sd_m=sides_sd_m,
        )

    def usual_pose(self, camera: Calibration) -> ObjectPose:
        """Return the pose of a building of the usual size, behind the middle of these walls."""
        median_px = float(np.median(self.disparity_px))
        focal_baseline = camera.fx_px * camera.baseline_m
        depth_m = focal_baseline / max(median_px, MIN_DISPARITY_PX)
        depth_sd_m = depth_m**2 / focal_baseline * bias_sd_px(len(self.columns))
        slope = (camera.cx_px - self.middle) / camera.fx_px
        forward_m = depth_m + camera.mount_forward_m
        left_m = slope * depth_m

        wall_m = float(np.hypot(forward_m, left_m))
        range_m = min(wall_m + USUAL_HALF_M, MAX_RANGE_M)
        hidden_m = 0.0 if self.whole else USUAL_HALF_M / 2
        lateral_sd_m = 0.1 * self.width_m(camera) + hidden_m + 0.3

        return ObjectPose(
            bearing_rad=float(np.arctan2(left_m, forward_m)),
            range_m=range_m,
            bearing_sd_rad=float(lateral_sd_m / range_m),
            range_sd_m=float(np.hypot(USUAL_SD_M, depth_sd_m)),
            misfit=0.0,
            width_m=2 * USUAL_HALF_M,
        )

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
    """Return the walls of `segment`, or None if too few columns have a known disparity;
    `disparity_px` (h, w) is that of the view, 0 unknown.
    """
    left, _, width, _ = segment.box_px
    span = slice(left, left + width)
    own_px = np.where(segment.mask[:, span], disparity_px[:, span], 0.0)
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
    """Compute the upper median of the positive values in each column of (h, w), 0 if there are
    fewer than MIN_PIXELS.
    """
    height, width = values.shape
    count = (values > 0).sum(0)
    above_median = np.maximum(count - 1, 0) // 2

    # The unknown ones are 0 and come first.
    ascending = np.sort(values, axis=0)
    row = height - 1 - above_median
    medians = ascending[row, np.arange(width)]

    return np.where(count >= MIN_PIXELS, medians, 0.0).astype(np.float32)


def _truly_ends(segment: Segment, disparity_px: Singles, medians_px: Singles, outward: int) -> bool:
    """Decide whether the object itself ends on that side (-1 left, 1 right), and is neither hidden
    by something nearer nor cut by the view.

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
    beside_px = disparity_px[rows, beyond]
    known_px = beside_px[beside_px > 0]
    return len(known_px) < MIN_PIXELS or bool(np.median(known_px) <= own_px + NEARER_PX)
