"""Poses in the plane, SE(2): x_m, y_m, heading_rad, the heading counter-clockwise from x.

A pose is an array of shape (3,), and n poses are one of shape (n, 3). Functions of two arrays
broadcast: one pose with many points, or as many poses as points. Headings that are returned lie in
(-pi, pi].
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats

FULL_TURN_RAD = 2 * np.pi


def wrap_angle(angle_rad: Floats) -> Floats:
    """The same angles in (-pi, pi], any shape."""
    wrapped: Floats = np.pi - (np.pi - angle_rad) % FULL_TURN_RAD
    return wrapped


def mean_angle(angles_rad: Floats) -> float:
    """The mean direction of (n,) angles, in radians."""
    return float(np.arctan2(np.sin(angles_rad).mean(), np.cos(angles_rad).mean()))


def rotation_matrices(heading_rad: Floats) -> Floats:
    """(..., 2, 2) matrices that rotate by angles of any shape (...): from a robot's axes to the
    world's.
    """
    cos = np.cos(heading_rad)
    sin = np.sin(heading_rad)
    rows = np.stack([cos, -sin, sin, cos], axis=-1)
    return rows.reshape(*rows.shape[:-1], 2, 2)


def rotate(vectors: Floats, angle_rad: Floats | float) -> Floats:
    """(..., 2) vectors rotated counter-clockwise, all by one angle or each by its own (...)."""
    cos = np.cos(angle_rad)
    sin = np.sin(angle_rad)

    x = cos * vectors[..., 0] - sin * vectors[..., 1]
    y = sin * vectors[..., 0] + cos * vectors[..., 1]
    return np.stack([x, y], axis=-1)


def polar(range_m: Floats, bearing_rad: Floats) -> Floats:
    """(..., 2) vectors as long as `range_m`, `bearing_rad` counter-clockwise from x."""
    return np.stack([range_m * np.cos(bearing_rad), range_m * np.sin(bearing_rad)], axis=-1)


def transform_from(pose: Floats, points_m: Floats) -> Floats:
    """(..., 2) points of the frame of `pose`, in the frame that `pose` is given in."""
    placed: Floats = pose[..., :2] + rotate(points_m, pose[..., 2])
    return placed


def transform_to(pose: Floats, points_m: Floats) -> Floats:
    """(..., 2) points of the frame that `pose` is given in, in the frame of `pose`."""
    return rotate(points_m - pose[..., :2], -pose[..., 2])


def compose(pose: Floats, step: Floats) -> Floats:
    """The pose that is `step` in the frame of `pose`, (..., 3)."""
    position_m = transform_from(pose, step[..., :2])
    heading_rad = wrap_angle(pose[..., 2] + step[..., 2])
    return np.concatenate([position_m, heading_rad[..., None]], axis=-1)


def relative(origin: Floats, pose: Floats) -> Floats:
    """`pose` in the frame of `origin`, (..., 3); `compose` undoes it."""
    position_m = transform_to(origin, pose[..., :2])
    heading_rad = wrap_angle(pose[..., 2] - origin[..., 2])
    return np.concatenate([position_m, heading_rad[..., None]], axis=-1)


def move_with(points_m: Floats, before: Floats, after: Floats) -> Floats:
    """(..., 2) points that stand to the poses `after` as they stood to the poses `before`."""
    turned_rad = after[..., 2] - before[..., 2]
    moved: Floats = after[..., :2] + rotate(points_m - before[..., :2], turned_rad)
    return moved


def integrate(start: Floats, steps: Floats) -> Floats:
    """(n + 1, 3): the poses that (n, 3) steps lead through from `start`, each step in the frame of
    the pose before it. Headings are not wrapped, so that turns can be counted.
    """
    headings_rad = start[2] + cumulative(steps[:, 2])
    moved_m = rotate(steps[:, :2], headings_rad[:-1])
    positions_m = start[:2] + cumulative(moved_m)
    return np.column_stack([positions_m, headings_rad])


def mean_pose(poses: Floats) -> Floats:
    """(3,): the mean of n poses, of the headings the mean direction. Columns after those of the
    pose are ignored, (n, 3 or more).
    """
    # A product with weights takes a fraction of the time of mean().
    weights = np.full(len(poses), 1 / len(poses))
    mean: Floats = (weights @ poses)[:3]

    headings_rad = np.ascontiguousarray(poses[:, 2])
    mean[2] = np.arctan2(weights @ np.sin(headings_rad), weights @ np.cos(headings_rad))
    return mean


def cumulative(values: Floats) -> Floats:
    """(n + 1, ...): sums of the first 0, 1, ... n of (n, ...) values."""
    nothing = np.zeros((1, *values.shape[1:]))
    return np.concatenate([nothing, np.cumsum(values, axis=0)])
