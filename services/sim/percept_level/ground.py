"""The road and its boundary on the ground before the robot, as EPAM publishes them: the mean point
of each cell. Pure.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.geometry.se2 import rotate
from cogmap.services.sim.layout.boundaries import Surfaces
from cogmap.services.sim.percept_level.column_camera import ColumnCamera

# As EPAM has them (services/epam/layout/ground.py), BESIDE_PX and BORDER_PX too.
MAX_RANGE_M = 15.0
CELL_M = 0.5
# Along each side of a cell: points are 0.25 m apart.
POINTS_A_CELL = 2
# A boundary is claimed if so many columns on both sides of a point show nothing nearer.
BESIDE_PX = 4
BORDER_PX = 3
_CELLS = round(MAX_RANGE_M / CELL_M) + 1


class Lattice:
    """Points on the ground in the field of view, fixed to the robot: where they are, (n, 2), their
    depth and image column, and the cell that each is in, numbered from 0, (n,).
    """

    def __init__(self, camera: ColumnCamera) -> None:
        step_m = CELL_M / POINTS_A_CELL
        at_m = np.arange(step_m / 2 - MAX_RANGE_M, MAX_RANGE_M, step_m)
        around_m = np.stack(np.meshgrid(at_m, at_m, indexing="ij"), axis=-1)
        points_m: Floats = around_m.reshape(-1, 2)
        depth_m = points_m[:, 0] - camera.mount.mount_forward_m
        is_ahead = depth_m > nearest_ground_m(camera)
        is_in_range = np.hypot(*points_m.T) <= MAX_RANGE_M

        ahead = np.flatnonzero(is_ahead & is_in_range)
        column = camera.column(depth_m[ahead], points_m[ahead, 1])
        is_seen = _is_inside(column, camera.width)
        seen = ahead[is_seen]

        self.points_m = points_m[seen]
        self.depth_m = depth_m[seen]
        self.column: Indices = np.rint(column[is_seen]).astype(np.int64)
        cells, self.cell = np.unique(_cell_numbers(self.points_m), return_inverse=True)
        self.cells = len(cells)

    def thinned(self, chosen: Indices) -> Singles:
        """Return the (k, 2) means of the chosen points in each cell, in the order of the cells."""
        return _means_m(self.points_m[chosen], self.cell[chosen], self.cells)


def nearest_ground_m(camera: ColumnCamera) -> float:
    """Return the depth of the ground in the lowest image row."""
    mount = camera.mount
    down = (mount.height_px - 1 - mount.cy_px) / mount.fy_px
    return mount.mount_height_m / down


def road_points_m(
    lattice: Lattice, pose: Floats, depth_m: Floats, streets: Surfaces, error_m: Floats
) -> Singles:
    """Return the (n, 2) points that show a street, in the robot's frame, thinned; what stands at
    `depth_m` in each column hides what is behind it.

    The street is seen `error_m` beside its place.
    """
    visible = np.flatnonzero(lattice.depth_m < depth_m[lattice.column])
    seen_m = lattice.points_m[visible] - error_m
    is_road = is_on_street(seen_m, pose, streets)
    return lattice.thinned(visible[is_road])


def is_on_street(points_m: Floats, pose: Floats, streets: Surfaces) -> Booleans:
    """Mark, (k,), those of (k, 2) points in the robot's frame that lie on a street."""
    here_along_m, here_left_m = streets.local(pose[None, :2])
    # Each street's directions along and to the left, in the robot's frame.
    along = rotate(streets.ahead, -pose[2])
    left = np.column_stack([-along[:, 1], along[:, 0]])

    from_here_m = points_m @ along.T
    beside_here_m = points_m @ left.T
    along_m = here_along_m + from_here_m
    left_m = here_left_m + beside_here_m

    is_along = np.abs(along_m) <= streets.half_length_m
    is_across = np.abs(left_m) <= streets.half_width_m
    is_inside = is_along & is_across
    return np.asarray(is_inside.any(axis=1))


def boundary_points_m(
    camera: ColumnCamera, pose: Floats, depth_m: Floats, kerbs_m: Floats, error_m: Floats
) -> Floats:
    """Return those of (k, 2) points of kerbs that are seen, (n, 2), in the robot's frame."""
    seen_m = camera.seen_from(pose, kerbs_m) + error_m
    is_ahead = seen_m[:, 0] > nearest_ground_m(camera)
    ahead_m = seen_m[is_ahead]

    column = camera.column(ahead_m[:, 0], ahead_m[:, 1])
    is_inside = _is_inside(column, camera.width, BORDER_PX)
    inside_m = ahead_m[is_inside]

    padded_m = np.pad(depth_m, BESIDE_PX, mode="edge")
    around_m = sliding_window_view(padded_m, 2 * BESIDE_PX + 1).min(axis=1)
    number = np.rint(column[is_inside]).astype(np.int64)
    is_visible = inside_m[:, 0] < around_m[number]

    points_m: Floats = inside_m[is_visible]
    points_m[:, 0] += camera.mount.mount_forward_m
    return points_m


def _is_inside(column: Floats, width: int, border: float = 0.0) -> Booleans:
    return np.asarray((column >= border) & (column <= width - 1 - border))


def thin(points_m: Floats) -> Singles:
    """Average the points (n, 2) within MAX_RANGE_M in each cell, in the order of the cells."""
    range_m = np.hypot(points_m[:, 0], points_m[:, 1])
    near_m = points_m[range_m <= MAX_RANGE_M]
    cell = _cell_numbers(near_m)
    return _means_m(near_m, cell, 1)


def _means_m(points_m: Floats, cell: npt.NDArray[np.intp], cells: int) -> Singles:
    """Average the points (n, 2) in each of the cells (n,) that they are in, and return (k, 2)."""
    count = np.bincount(cell, minlength=cells)
    occupied = np.flatnonzero(count)
    sum_x_m = np.bincount(cell, points_m[:, 0], minlength=cells)
    sum_y_m = np.bincount(cell, points_m[:, 1], minlength=cells)
    sums_m = np.column_stack([sum_x_m[occupied], sum_y_m[occupied]])

    means_m = sums_m / count[occupied, None]
    return means_m.astype(np.float32)


def _cell_numbers(points_m: Floats) -> npt.NDArray[np.intp]:
    """Return the number of the cell of each point (n, 2), x before y."""
    in_cells = points_m / CELL_M
    lower = np.floor(in_cells).astype(np.intp)
    row, column = lower.T + _CELLS

    columns = 2 * _CELLS
    numbers = row * columns + column
    return np.asarray(numbers)
