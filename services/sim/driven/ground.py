"""The road and its boundary on the ground before the robot, as EPAM publishes them: the mean point
of each cell. Pure.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from services.sim.driven.camera import ColumnCamera
from services.sim.layout.boundaries import Surfaces

MAX_RANGE_M = 15.0
CELL_M = 0.5
POINTS_A_CELL = 2
# Columns beside a point that must not show anything nearer, where a boundary is claimed.
BESIDE_PX = 4
BORDER_PX = 3
_CELLS = round(MAX_RANGE_M / CELL_M) + 1


class Lattice:
    """Points on the ground in the field of view, fixed to the robot."""

    def __init__(self, camera: ColumnCamera) -> None:
        step_m = CELL_M / POINTS_A_CELL
        at_m = np.arange(-MAX_RANGE_M + step_m / 2, MAX_RANGE_M, step_m)
        forward_m, left_m = np.meshgrid(at_m, at_m, indexing="ij")
        points_m = np.column_stack([forward_m.ravel(), left_m.ravel()])

        mount = camera.mount
        depth_m = points_m[:, 0] - mount.mount_forward_m
        is_ahead = depth_m > nearest_ground_m(camera)
        is_in_range = np.hypot(*points_m.T) <= MAX_RANGE_M
        points_m = points_m[is_ahead & is_in_range]

        depth_m = points_m[:, 0] - mount.mount_forward_m
        column = camera.column(depth_m, points_m[:, 1])
        is_seen = _is_inside(column, camera.width)

        self.points_m = points_m[is_seen]
        self.depth_m = depth_m[is_seen]
        self.column: Indices = np.rint(column[is_seen]).astype(np.int64)


def nearest_ground_m(camera: ColumnCamera) -> float:
    """The depth of the ground in the lowest image row."""
    mount = camera.mount
    down = (mount.height_px - 1 - mount.cy_px) / mount.fy_px
    return mount.mount_height_m / down


def road_points_m(
    lattice: Lattice, pose: Floats, depth_m: Floats, streets: Surfaces, error_m: Floats
) -> Singles:
    """(n, 2): the points that show a street, in the robot's frame, thinned; what stands at
    `depth_m` in each column hides what is behind it.

    `error_m` is by how much the street is seen beside its place.
    """
    is_visible = lattice.depth_m < depth_m[lattice.column]
    visible_m = lattice.points_m[is_visible]

    is_road = is_on_street(visible_m - error_m, pose, streets)
    return thin(visible_m[is_road])


def is_on_street(points_m: Floats, pose: Floats, streets: Surfaces) -> Booleans:
    """(k,): which of (k, 2) points in the robot's frame lie on a street."""
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    robot_along_m, robot_left_m = streets.local(pose[None, :2])
    ahead = streets.ahead[:, 0] * cos + streets.ahead[:, 1] * sin
    left = streets.ahead[:, 1] * cos - streets.ahead[:, 0] * sin

    on_street = np.zeros(len(points_m), bool)
    forward_m, sideways_m = points_m.T
    for number in range(len(ahead)):
        along_m = robot_along_m[0, number] + forward_m * ahead[number] + sideways_m * left[number]
        aside_m = robot_left_m[0, number] + sideways_m * ahead[number] - forward_m * left[number]
        is_along = np.abs(along_m) <= streets.half_length_m[number]
        is_across = np.abs(aside_m) <= streets.half_width_m[number]
        on_street |= is_along & is_across

    return on_street


def boundary_points_m(
    camera: ColumnCamera, pose: Floats, depth_m: Floats, kerbs_m: Floats, error_m: Floats
) -> Floats:
    """(n, 2): the points of (k, 2) kerbs that are seen, in the robot's frame."""
    seen_m = camera.seen_from(pose, kerbs_m) + error_m
    is_ahead = seen_m[:, 0] > nearest_ground_m(camera)
    ahead_m = seen_m[is_ahead]

    column = camera.column(ahead_m[:, 0], ahead_m[:, 1])
    is_inside = _is_inside(column, camera.width, BORDER_PX)
    inside_m = ahead_m[is_inside]

    around_m = _least_around(depth_m)
    number = np.rint(column[is_inside]).astype(np.int64)
    is_visible = inside_m[:, 0] < around_m[number]

    points_m: Floats = inside_m[is_visible]
    points_m[:, 0] += camera.mount.mount_forward_m
    return points_m


def _is_inside(column: Floats, width: int, border: float = 0.0) -> Booleans:
    return np.asarray((column >= border) & (column <= width - 1 - border))


def _least_around(depth_m: Floats) -> Floats:
    """(width,): the least depth within BESIDE_PX columns of each."""
    padded = np.pad(depth_m, BESIDE_PX, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * BESIDE_PX + 1)
    return np.asarray(windows.min(axis=1))


def thin(points_m: Floats) -> Singles:
    """The mean of the points (n, 2) within MAX_RANGE_M in each cell, in the order of the cells."""
    range_m = np.hypot(points_m[:, 0], points_m[:, 1])
    near_m = points_m[range_m <= MAX_RANGE_M]
    cell = _cell_numbers(near_m)

    count = np.bincount(cell, minlength=1)
    occupied = np.flatnonzero(count)
    sum_x_m = np.bincount(cell, near_m[:, 0], minlength=1)
    sum_y_m = np.bincount(cell, near_m[:, 1], minlength=1)
    sums_m = np.column_stack([sum_x_m[occupied], sum_y_m[occupied]])

    means_m = sums_m / count[occupied, None]
    return means_m.astype(np.float32)


def _cell_numbers(points_m: Floats) -> npt.NDArray[np.intp]:
    """The number of the cell of each point (n, 2), x before y."""
    cells = np.floor(points_m / CELL_M).astype(np.intp) + _CELLS
    row, column = cells.T
    return np.asarray(row * 2 * _CELLS + column)
