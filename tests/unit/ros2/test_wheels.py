"""Odometry as it comes, as motions that end at views."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.data.bags.topics import ODOMETRY
from cogmap.errors import UsageError
from cogmap.geometry.se2 import compose
from cogmap.recording.exporting.ros_drive import arc_of
from cogmap.ros2.wheels import OdometryStream
from cogmap.schemas.sensing import Odometry

S = 10**9
AHEAD = np.array([1.0, 0.0])


def straight(stream: OdometryStream, *at_s: float, speeds: np.ndarray = AHEAD) -> None:
    """Receive the poses of a robot that drives ahead at 1 m/s."""
    for each_s in at_s:
        stream.on_pose(round(each_s * S), np.array([each_s, 0.0, 0.0]), speeds)


def rows(moved: list[Odometry]) -> list[tuple[float, float, float]]:
    return [(each.stamp_ns / S, each.speed_m_s, each.dt_s) for each in moved]


def test_a_motion_ends_at_each_view_between_two_poses() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    straight(stream, 1.0, 1.5, 2.0)

    assert stream.until(round(1.25 * S)) == []
    assert rows(stream.until(round(1.75 * S))) == [
        pytest.approx((1.5, 1.0, 0.25)),
        pytest.approx((1.75, 1.0, 0.25)),
    ]


def test_a_view_that_is_newer_than_the_last_pose_does_not_wait() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    straight(stream, 1.0)
    stream.until(S)
    straight(stream, 1.1)

    assert rows(stream.until(round(1.2 * S))) == [
        pytest.approx((1.1, 1.0, 0.1)),
        pytest.approx((1.2, 1.0, 0.1)),
    ]


def test_no_error_adds_up_where_speeds_were_wrong() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    straight(stream, 1.0, speeds=np.array([9.0, 0.0]))
    stream.until(S)
    moved = []
    for step in range(1, 20):
        straight(stream, 1.0 + step / 10, speeds=np.array([9.0, 0.0]))
        moved += stream.until(round((1.05 + step / 10) * S))
    straight(stream, 3.0, speeds=np.array([0.0, 0.0]))
    moved += stream.until(3 * S)

    pose = np.array([1.0, 0.0, 0.0])
    for each in moved:
        pose = compose(pose, arc_of(each))
    assert pose == pytest.approx([3.0, 0.0, 0.0], abs=1e-9)


def test_poses_that_nobody_fills_in_are_those_to_which_the_speeds_lead() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    for at_s in (1, 2, 3):
        stream.on_pose(at_s * S, np.zeros(3), AHEAD)

    assert stream.pose_at(3 * S) == pytest.approx([2.0, 0.0, 0.0])


def test_a_jump_is_left_out_and_counted() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    straight(stream, 1.0)
    stream.until(S)
    stream.on_pose(round(1.1 * S), np.array([900.0, 0.0, 0.0]), AHEAD)
    stream.until(round(1.1 * S))
    stream.on_pose(round(1.2 * S), np.array([900.1, 0.0, 0.0]), AHEAD)

    assert rows(stream.until(round(1.2 * S))) == [pytest.approx((1.2, 1.0, 0.1))]
    assert stream.jumps == 1


def test_a_pose_that_is_older_than_the_last_is_ignored() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    straight(stream, 1.0, 2.0, 1.5)

    assert stream.pose_at(2 * S) == pytest.approx([2.0, 0.0, 0.0])


def test_what_is_missing_or_late_or_no_number_is_named() -> None:
    stream = OdometryStream("/odom", ODOMETRY)
    with pytest.raises(UsageError, match=r"nothing of the .* has come on /odom .*--no-odometry"):
        stream.until(S)
    with pytest.raises(UsageError, match="numbers that are not finite"):
        stream.on_pose(S, np.array([np.nan, 0.0, 0.0]), AHEAD)

    straight(stream, 1.0)
    with pytest.raises(UsageError, match=r"a view is 0\.8 s newer .* stamp both by one clock"):
        stream.until(round(1.8 * S))
