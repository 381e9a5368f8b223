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
    """Return the same angles in (-pi, pi], any shape."""
    from_pi = (np.pi - angle_rad) % FULL_TURN_RAD
    wrapped: Floats = np.pi - from_pi
    return wrapped


def rotation_matrices(heading_rad: Floats) -> Floats:
    """Return (..., 2, 2) matrices that rotate by angles of any shape (...): from a robot's axes to
    the world's.
    """
    cos = np.cos(heading_rad)
    sin = np.sin(heading_rad)
    rows = np.stack([cos, -sin, sin, cos], axis=-1)
    return rows.reshape(*rows.shape[:-1], 2, 2)


def rotate(vectors: Floats, angle_rad: Floats | float) -> Floats:
    """Rotate (..., 2) vectors counter-clockwise, all by one angle or each by its own (...)."""
    cos = np.cos(angle_rad)
    sin = np.sin(angle_rad)
    x = vectors[..., 0]
    y = vectors[..., 1]

    rotated_x = cos * x - sin * y
    rotated_y = sin * x + cos * y
    return np.stack([rotated_x, rotated_y], axis=-1)


def transform_from(pose: Floats, points_m: Floats) -> Floats:
    """Transform (..., 2) points from the frame of `pose` to the frame that `pose` is given in."""
    rotated_m = rotate(points_m, pose[..., 2])
    placed: Floats = pose[..., :2] + rotated_m
    return placed


def transform_to(pose: Floats, points_m: Floats) -> Floats:
    """Transform (..., 2) points from the frame that `pose` is given in to the frame of `pose`."""
    offset_m = points_m - pose[..., :2]
    return rotate(offset_m, -pose[..., 2])


def compose(pose: Floats, step: Floats) -> Floats:
    """Return the pose that is `step` in the frame of `pose`, (..., 3)."""
    position_m = transform_from(pose, step[..., :2])
    heading_rad = pose[..., 2] + step[..., 2]
    return _pose(position_m, heading_rad)


def relative(origin: Floats, pose: Floats) -> Floats:
    """Return `pose` in the frame of `origin`, (..., 3); `compose` undoes it."""
    position_m = transform_to(origin, pose[..., :2])
    heading_rad = pose[..., 2] - origin[..., 2]
    return _pose(position_m, heading_rad)


def _pose(position_m: Floats, heading_rad: Floats) -> Floats:
    wrapped = wrap_angle(heading_rad)
    return np.concatenate([position_m, wrapped[..., None]], axis=-1)


def move_with(points_m: Floats, before: Floats, after: Floats) -> Floats:
    """Move (..., 2) points: they stand to the poses `after` as they stood to the poses `before`."""
    turned_rad = after[..., 2] - before[..., 2]
    offset_m = points_m - before[..., :2]
    moved: Floats = after[..., :2] + rotate(offset_m, turned_rad)
    return moved


def integrate(start: Floats, steps: Floats) -> Floats:
    """Return the (n + 1, 3) poses that (n, 3) steps lead through from `start`, each step in the
    frame of the pose before it. Headings are not wrapped, so that turns can be counted.
    """
    headings_rad = start[2] + cumulative(steps[:, 2])
    moved_m = rotate(steps[:, :2], headings_rad[:-1])
    positions_m = start[:2] + cumulative(moved_m)
    return np.column_stack([positions_m, headings_rad])


def arc(length_m: float, turned_rad: float) -> Floats:
    """Return where an arc of a circle leads to, (3,), that begins at the origin along x."""
    chord_m = length_m * np.sinc(turned_rad / (2 * np.pi))
    middle_rad = turned_rad / 2
    return np.array([chord_m * np.cos(middle_rad), chord_m * np.sin(middle_rad), turned_rad])


def moved_by(pose: Floats, motions: Floats) -> Floats:
    """Return the pose (3,) that a self-motion leads to from `pose`. The motion has (n, 3 or more)
    rows that begin with speed in m/s, turn rate in rad/s and duration in s.
    """
    speed, turn_rate, duration_s = motions[:, :3].T
    steps = np.column_stack([speed * duration_s, np.zeros(len(motions)), turn_rate * duration_s])
    moved: Floats = integrate(pose, steps)[-1]
    return moved


def mean_pose(poses: Floats) -> Floats:
    """Average n poses: (3,), with the mean direction of the headings. Columns after those of the
    pose are ignored, (n, 3 or more).
    """
    # A product with weights takes a fraction of the time of mean().
    weights = np.full(len(poses), 1 / len(poses))
    mean: Floats = (weights @ poses)[:3]

    headings_rad = np.ascontiguousarray(poses[:, 2])
    sin = weights @ np.sin(headings_rad)
    cos = weights @ np.cos(headings_rad)
    mean[2] = np.arctan2(sin, cos)
    return mean


def cumulative(values: Floats) -> Floats:
    """Sum the first 0, 1, ... n of (n, ...) values: (n + 1, ...)."""
    zero = np.zeros((1, *values.shape[1:]))
    sums = np.cumsum(values, axis=0)
    return np.concatenate([zero, sums])
