"""The walls of a segment: how far each of its columns is, and whether the object truly ends where
it seems to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.sensing import Calibration
from services.epam.layout.footprint_fit import Outline, Place
from services.epam.recognition.segments import Segment

Floats = npt.NDArray[np.float64]
Disparity = npt.NDArray[np.float32]

FEWEST_PIXELS = 4
FEWEST_COLUMNS = 3
BESIDE_PX = 4
WITHIN_PX = 3
NEARER_PX = 0.3
MIXED_PX = 2
MIXED_WHERE_HIDDEN_PX = 5
USUAL_HALF_M = 4.5
USUAL_SD_M = 1.5
LEAST_DISPARITY_PX = 0.5
MOST_RANGE_M = 400.0


@dataclass(frozen=True, eq=False)
class Walls:
    """Columns (n,) of the view with their disparity in pixels (n,), and where the segment begins
    and ends.
    """

    columns: Floats
    disparity_px: Floats
    left: float
    right: float
    left_true: bool
    right_true: bool

    @property
    def whole(self) -> bool:
        """Whether neither the image's border nor another object cuts it."""
        return self.left_true and self.right_true

    def outline(self, sides_m: tuple[float, float]) -> Outline:
        """What geometry needs of them, less the columns at each end where the depths of two things
        mix.

        Depth spreads from what is nearer over what it hides, so more is left out where the object
        is hidden.
        """
        spare = (len(self.columns) - FEWEST_COLUMNS) // 2
        mixed = (
            MIXED_PX if true else MIXED_WHERE_HIDDEN_PX
            for true in (self.left_true, self.right_true)
        )
        first, last = (max(0, min(number, spare)) for number in mixed)
        inner = slice(first, len(self.columns) - last)
        columns = self.columns[inner]
        disparity = self.disparity_px[inner]
        matched = columns >= disparity
        if matched.sum() >= FEWEST_COLUMNS:
            columns = columns[matched]
            disparity = disparity[matched]
        return Outline(
            columns, disparity, self.left, self.right, self.left_true, self.right_true, sides_m
        )

    def roughly(self, camera: Calibration) -> Place:
        """Where the middle of a building of the usual size is, behind the middle of what is seen of
        it.
        """
        depth_m = (
            camera.fx_px
            * camera.baseline_m
            / max(float(np.median(self.disparity_px)), LEAST_DISPARITY_PX)
        )
        slope = (camera.cx_px - (self.left + self.right) / 2) / camera.fx_px
        forward_m = depth_m + camera.mount_forward_m
        left_m = slope * depth_m
        seen_m = float(np.hypot(forward_m, left_m))
        range_m = min(seen_m + USUAL_HALF_M, MOST_RANGE_M)
        wide_m = self.width_m(camera)
        hidden_m = 0.0 if self.whole else USUAL_HALF_M / 2
        return Place(
            bearing_rad=float(np.arctan2(left_m, forward_m)),
            range_m=range_m,
            bearing_sd_rad=float((0.1 * wide_m + hidden_m + 0.3) / range_m),
            range_sd_m=float(np.hypot(USUAL_SD_M, 0.05 * range_m)),
            misfit=0.0,
        )

    def width_m(self, camera: Calibration) -> float:
        """How far apart its ends are, across the view."""
        ends = self.disparity_px[[0, -1]].clip(LEAST_DISPARITY_PX)
        depth_m = camera.fx_px * camera.baseline_m / ends
        across_m = (np.array([self.left, self.right]) - camera.cx_px) / camera.fx_px * depth_m
        return float(min(np.hypot(np.ptp(across_m), np.ptp(depth_m)), MOST_RANGE_M))


def walls(segment: Segment, disparity_px: Disparity) -> Walls | None:
    """The walls of `segment`, where `disparity_px` (h, w) is that of the view, 0 unknown; None
    where it is unknown.
    """
    left, _, wide, _ = segment.box_px
    span = slice(left, left + wide)
    shown = segment.mask[:, span]
    middle = _middles(np.where(shown, disparity_px[:, span], 0.0))
    known = np.flatnonzero(middle)
    if len(known) < FEWEST_COLUMNS:
        return None
    ends = [_ends(segment, disparity_px, middle, outward) for outward in (-1, 1)]
    columns = (known + left).astype(np.float64)
    return Walls(
        columns, middle[known].astype(np.float64), left - 0.5, left + wide - 0.5, ends[0], ends[1]
    )


def _middles(values: Disparity) -> Disparity:
    """The median of the values over 0 in each column of (h, w); 0 where there are fewer than
    FEWEST_PIXELS.
    """
    count = (values > 0).sum(0)
    ordered = np.sort(values, axis=0)
    row = len(values) - 1 - np.maximum(count - 1, 0) // 2
    return np.where(count >= FEWEST_PIXELS, ordered[row, np.arange(values.shape[1])], 0.0).astype(
        np.float32
    )


def _ends(segment: Segment, disparity_px: Disparity, middle: Disparity, outward: int) -> bool:
    """Whether the object itself ends on that side, and is not hidden or cut off by the view.

    On the left the view ends, for what is nearer, where the right camera's does: as far in as the
    disparity.
    """
    left, _, wide, _ = segment.box_px
    within = min(WITHIN_PX, wide - 1)
    inside = wide - 1 - within if outward > 0 else within
    edge = left + wide - 1 if outward > 0 else left
    beyond = edge + BESIDE_PX * outward
    if not 0 <= beyond < disparity_px.shape[1] or beyond < middle[inside]:
        return False
    rows = segment.mask[:, left + inside]
    beside = disparity_px[rows, beyond]
    beside = beside[beside > 0]
    return len(beside) < FEWEST_PIXELS or bool(np.median(beside) <= middle[inside] + NEARER_PX)
