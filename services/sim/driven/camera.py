"""What a camera on the robot would see of walls and obstacles: the nearest in each image column.
Pure.

Along a straight wall the inverse of depth is a linear function of the image column, so that the
nearest of many walls is the greatest of many linear functions: a depth buffer of one row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import transform_to
from schemas.sensing import Calibration

NEAR_M = 0.05
NOTHING = -1
_EDGE_ON_M = 1e-9


class Buffer(NamedTuple):
    """The nearest in each image column: inverse depth, 0 where there is nothing, and which of the
    segments it is, NOTHING where it is none, (width,) each.
    """

    inverse_m: Floats
    segment: Indices


def depths_m(inverse_m: Floats) -> Floats:
    """Depths from inverse depths of any shape, infinite where these are 0."""
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
        """The angle between the axis and the side of the image that is farther from it."""
        mount = self.mount
        half_px = max(mount.cx_px, mount.width_px - mount.cx_px)
        return math.atan(half_px / mount.fx_px)

    def column(self, forward_m: Floats, left_m: Floats) -> Floats:
        """The image column, with a fraction, of points before the camera, of any shape."""
        left_slope = left_m / forward_m
        columns: Floats = self.mount.cx_px - left_slope * self.mount.fx_px
        return columns

    def seen_from(self, pose: Floats, points_m: Floats) -> Floats:
        """(..., 2) points of the world as forward and left of the camera of a robot at `pose`."""
        robot_m = transform_to(pose, points_m)
        robot_m[..., 0] -= self.mount.mount_forward_m
        return robot_m

    def nearest(self, pose: Floats, segments_m: Floats) -> Buffer:
        """The nearest of (n, 4) segments in each column."""
        ends_m = self.seen_from(pose, segments_m.reshape(-1, 2, 2))
        numbers = np.flatnonzero(self._may_be_seen(ends_m))
        if not len(numbers):
            return self._empty()

        inverse_m = self._inverse_depths(ends_m[numbers])
        best = inverse_m.argmax(axis=0)
        columns = np.arange(self.width)
        nearest = inverse_m[best, columns]

        segment = np.where(nearest > 0.0, numbers[best], NOTHING)
        return Buffer(nearest, segment)

    def _empty(self) -> Buffer:
        nothing = np.full(self.width, NOTHING)
        return Buffer(np.zeros(self.width), nothing)

    def _may_be_seen(self, ends_m: Floats) -> Booleans:
        """(n,): which of (n, 2, 2) segments have a part before the camera, and not both ends beyond
        the same side of the image.
        """
        forward_m = ends_m[..., 0]
        left_m = ends_m[..., 1]

        is_before = (forward_m > NEAR_M).any(axis=1)
        beyond_left = (left_m > self.left_slope[0] * forward_m).all(axis=1)
        beyond_right = (left_m < self.left_slope[-1] * forward_m).all(axis=1)
        return np.asarray(is_before & ~beyond_left & ~beyond_right)

    def _inverse_depths(self, ends_m: Floats) -> Floats:
        """(n, width): the inverse depth of (n, 2, 2) segments in each column, 0 where they are not
        seen.
        """
        clipped_m = _before_camera(ends_m)
        start_m = clipped_m[:, 0]
        end_m = clipped_m[:, 1]

        # The line through both ends: normal . point = offset.
        along_m = end_m - start_m
        normal_forward = -along_m[:, 1]
        normal_left = along_m[:, 0]
        offset_m2 = normal_forward * start_m[:, 0] + normal_left * start_m[:, 1]

        is_edge_on = np.abs(offset_m2) < _EDGE_ON_M
        safe_m2 = np.where(is_edge_on, 1.0, offset_m2)
        at_axis = (normal_forward / safe_m2)[:, None]
        by_slope = (normal_left / safe_m2)[:, None]
        inverse_m: Floats = at_axis + by_slope * self.left_slope

        slopes = clipped_m[..., 1] / clipped_m[..., 0]
        lowest = slopes.min(axis=1)[:, None]
        highest = slopes.max(axis=1)[:, None]
        is_outside = (self.left_slope < lowest) | (self.left_slope > highest)
        inverse_m[is_outside | is_edge_on[:, None]] = 0.0
        return inverse_m


def _before_camera(ends_m: Floats) -> Floats:
    """(n, 2, 2) segments, cut off at NEAR_M before the camera."""
    forward_m = ends_m[..., 0]
    change_m = forward_m[:, 1] - forward_m[:, 0]
    is_level = np.abs(change_m) < _EDGE_ON_M
    share = (NEAR_M - forward_m[:, 0]) / np.where(is_level, 1.0, change_m)

    along_m = ends_m[:, 1] - ends_m[:, 0]
    cut_m = ends_m[:, 0] + share[:, None] * along_m

    is_behind = forward_m < NEAR_M
    return np.where(is_behind[..., None], cut_m[:, None], ends_m)
