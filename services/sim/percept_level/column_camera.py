"""What a camera on the robot would see of walls and obstacles: the nearest in each image column.
Pure.

Along a straight wall the inverse of depth is a linear function of the image column, so that the
nearest of many walls is the greatest of many linear functions: a depth buffer of one row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import transform_to
from cogmap.schemas.sensing import Calibration

# What is nearer is cut off: the robot's body keeps 0.3 m before its camera.
NEAR_M = 0.05
NOTHING = -1
# A building or a post is whole in a view if so large a part of its columns shows it.
WHOLE_SHARE = 0.9
# Below this, a line leads through the camera or runs across its axis: above rounding.
_EDGE_ON_M = 1e-9


class Buffer(NamedTuple):
    """The nearest in each image column: inverse depth, 0 where there is nothing, and which of the
    segments it is, NOTHING where it is none, (width,) each.
    """

    inverse_m: Floats
    segment: Indices


def depths_m(inverse_m: Floats) -> Floats:
    """Compute depths from inverse depths of any shape, infinite where these are 0."""
    with np.errstate(divide="ignore"):
        depth_m: Floats = 1.0 / inverse_m
    return depth_m


class ColumnCamera:
    """The left camera, as it is mounted, column by column."""

    def __init__(self, mount: Calibration) -> None:
        self.mount = mount
        self.width = mount.width_px
        columns = np.arange(mount.width_px)
        left_px = mount.cx_px - columns
        self.left_slope: Floats = np.asarray(left_px / mount.fx_px, float)

    @property
    def half_field_of_view_rad(self) -> float:
        """Return the angle between the axis and the side of the image that is farther from it."""
        mount = self.mount
        half_px = max(mount.cx_px, mount.width_px - mount.cx_px)
        return math.atan(half_px / mount.fx_px)

    def column(self, forward_m: Floats, left_m: Floats) -> Floats:
        """Return the image column, with a fraction, of points before the camera, of any shape."""
        left_slope = left_m / forward_m
        columns: Floats = self.mount.cx_px - left_slope * self.mount.fx_px
        return columns

    def seen_from(self, pose: Floats, points_m: Floats) -> Floats:
        """Return world points (..., 2) as forward and left of the camera of a robot at `pose`."""
        robot_m = transform_to(pose, points_m)
        robot_m[..., 0] -= self.mount.mount_forward_m
        return robot_m

    def nearest(self, pose: Floats, segments_m: Floats) -> Buffer:
        """Return the nearest of (n, 4) segments in each column."""
        ends_m = self.seen_from(pose, segments_m.reshape(-1, 2, 2))

        # They have a part before the camera, and not both ends beyond the same side of the image.
        forward_m = ends_m[..., 0]
        left_m = ends_m[..., 1]
        beyond_left = (left_m > self.left_slope[0] * forward_m).all(axis=1)
        beyond_right = (left_m < self.left_slope[-1] * forward_m).all(axis=1)
        is_before = (forward_m > NEAR_M).any(axis=1)
        numbers = np.flatnonzero(is_before & ~(beyond_left | beyond_right))
        if not len(numbers):
            return Buffer(np.zeros(self.width), np.full(self.width, NOTHING))

        clipped_m = _before_camera(ends_m[numbers])
        at_axis, by_slope = _inverse_depth_of_lines(clipped_m)
        inverse_m: Floats = at_axis[:, None] + by_slope[:, None] * self.left_slope

        slopes = clipped_m[..., 1] / clipped_m[..., 0]
        is_right = self.left_slope < slopes.min(axis=1)[:, None]
        is_left = self.left_slope > slopes.max(axis=1)[:, None]
        inverse_m[is_right | is_left] = 0.0

        best = inverse_m.argmax(axis=0)
        nearest = inverse_m[best, np.arange(self.width)]
        segment = np.where(nearest > 0.0, numbers[best], NOTHING)
        return Buffer(nearest, segment)


def _inverse_depth_of_lines(ends_m: Floats) -> tuple[Floats, Floats]:
    """Compute the inverse depth of the lines through (n, 2, 2) segments on the optical axis, and
    its change with the slope to the left, (n,) each; 0 for lines through the camera.
    """
    start_m = ends_m[:, 0]
    along_m = ends_m[:, 1] - start_m

    # Of the points of a line: normal . point = offset.
    normal_forward = -along_m[:, 1]
    normal_left = along_m[:, 0]
    forward_part_m2 = normal_forward * start_m[:, 0]
    left_part_m2 = normal_left * start_m[:, 1]
    offset_m2 = forward_part_m2 + left_part_m2

    is_edge_on = np.abs(offset_m2) < _EDGE_ON_M
    offset_m2[is_edge_on] = np.inf
    return normal_forward / offset_m2, normal_left / offset_m2


def _before_camera(ends_m: Floats) -> Floats:
    """Cut off (n, 2, 2) segments at NEAR_M before the camera."""
    forward_m = ends_m[..., 0]
    start_m = ends_m[:, 0]
    along_m = ends_m[:, 1] - start_m

    change_m = along_m[:, 0]
    is_level = np.abs(change_m) < _EDGE_ON_M
    divisor_m = np.where(is_level, 1.0, change_m)
    share = (NEAR_M - start_m[:, 0]) / divisor_m

    cut_m = start_m + share[:, None] * along_m
    is_behind = forward_m < NEAR_M
    return np.where(is_behind[..., None], cut_m[:, None], ends_m)
