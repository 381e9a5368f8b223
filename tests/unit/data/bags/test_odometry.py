"""Odometry of ROS as motions between views."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.data.bags.odometry import NS_PER_S, Motions, Poses
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import wrap_angle

STAMPS_NS = 1_700_000_000 * NS_PER_S + np.arange(5) * NS_PER_S // 2
NO_SPEEDS = np.zeros((5, 2))


def _arcs(speed_m_s: float, turn_rate_rad_s: float) -> Floats:
    """Poses along a circle, half a second apart."""
    turned_rad = turn_rate_rad_s * np.arange(5) / 2
    radius_m = speed_m_s / turn_rate_rad_s
    x_m = radius_m * np.sin(turned_rad)
    y_m = radius_m * (1 - np.cos(turned_rad))
    return np.column_stack([x_m, y_m, wrap_angle(turned_rad)])


def _motions(poses: Floats, views_ns: list[int], speeds: Floats = NO_SPEEDS) -> Motions:
    return Poses(STAMPS_NS, poses, speeds).motions(np.array(views_ns, np.int64))


@pytest.mark.parametrize("turn_rate_rad_s", [0.001, 1.0, -3.0])
@pytest.mark.parametrize("speed_m_s", [2.0, -0.5])
def test_the_speeds_are_those_of_the_arcs(speed_m_s: float, turn_rate_rad_s: float) -> None:
    motions = _motions(_arcs(speed_m_s, turn_rate_rad_s), [])

    assert motions.stamps_ns.tolist() == STAMPS_NS[1:].tolist()
    assert np.allclose(motions.rows, [speed_m_s, turn_rate_rad_s, 0.5])
    assert motions.jumps == 0


def test_a_motion_ends_at_each_view() -> None:
    view_ns = int(STAMPS_NS[1]) + NS_PER_S // 10

    motions = _motions(_arcs(1.0, 0.1), [view_ns])

    assert view_ns in motions.stamps_ns.tolist()
    assert motions.rows[:, 2] == pytest.approx([0.5, 0.1, 0.4, 0.5, 0.5])
    assert np.allclose(motions.rows[:, :2], [1.0, 0.1])


def test_poses_that_nobody_filled_in_leave_the_speeds() -> None:
    speeds = np.array([[9.0, 9.0], [1.0, 0.1], [2.0, 0.2], [3.0, 0.3], [4.0, 0.4]])

    motions = _motions(np.zeros((5, 3)), [], speeds)

    assert np.array_equal(motions.rows[:, :2], speeds[1:])


def test_a_jump_is_left_out_and_counted() -> None:
    poses = _arcs(1.0, 0.1)
    poses[3:, 0] += 1000.0

    motions = _motions(poses, [])

    assert motions.jumps == 1
    assert motions.rows[2].tolist() == [0.0, 0.0, 0.5]


def test_a_long_motion_is_divided() -> None:
    stamps_ns = STAMPS_NS[0] + np.array([0, 25]) * NS_PER_S
    poses = np.array([[0.0, 0.0, 0.0], [50.0, 0.0, 0.0]])

    motions = Poses(stamps_ns, poses, NO_SPEEDS[:2]).motions(np.zeros(0, np.int64))

    assert motions.rows.tolist() == [[2.0, 0.0, 10.0], [2.0, 0.0, 10.0], [2.0, 0.0, 5.0]]
