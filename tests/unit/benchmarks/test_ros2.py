"""What the benchmark of robots counts."""

from __future__ import annotations

import pytest

from benchmarks.ros2 import robot
from benchmarks.ros2.measure import UNCOUNTED, VIEWS, Mind, metrics_of
from benchmarks.ros2.robot import Driven
from cogmap.robot import WHEEL_RADIUS_M, calibration
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import StereoFrame

MS = 10**6
EVERY = range(5, 5 + UNCOUNTED + VIEWS + 3)


def driven() -> tuple[Mind, Driven]:
    """A drive in which each view takes 4 ms, and each command 2 ms."""
    mind = Mind()
    for number in EVERY:
        mind.frames[number] = number - EVERY[0]
        mind.views_ns[number] = 100 * MS * number + 4 * MS
        mind.commands_ns[number] = mind.views_ns[number] + MS
    views_ns = {number: 100 * MS * number for number in EVERY}
    commands_ns = {number: sent_ns + 2 * MS for number, sent_ns in mind.commands_ns.items()}
    return mind, Driven(views_ns, commands_ns)


def test_the_latency_is_that_of_the_slower_way() -> None:
    mind, there = driven()
    metrics = metrics_of(mind, there)

    assert (metrics["view_ms_p50"], metrics["command_ms_p50"]) == pytest.approx((4.0, 2.0))
    assert metrics["latency_ms_p99"] == pytest.approx(4.0)
    assert (metrics["lost"], metrics["superseded"], metrics["views"]) == (0, 0, VIEWS)


def test_a_view_that_another_one_overtook_is_not_lost() -> None:
    mind, there = driven()
    for held in (mind.frames, mind.views_ns, mind.commands_ns, there.commands_ns):
        del held[100]
    metrics = metrics_of(mind, there)

    assert (metrics["lost"], metrics["superseded"]) == (0, 1)


def test_a_pair_that_the_bridge_did_not_publish_is_lost_and_so_is_a_command() -> None:
    mind, there = driven()
    for held in (mind.frames, mind.views_ns, mind.commands_ns, there.commands_ns):
        del held[100]
    for number in range(101, EVERY[-1] + 1):
        mind.frames[number] -= 1
    del there.commands_ns[200]
    metrics = metrics_of(mind, there)

    assert (metrics["lost"], metrics["superseded"]) == (2, 0)


def test_a_view_says_its_number_and_is_answered_by_it() -> None:
    left, right = robot.pair(77)
    frame = StereoFrame(
        stamp_ns=5, frame=3, left=Array.of(left), right=Array.of(right), calibration=calibration()
    )
    mind = Mind()
    command = mind.on_frame(frame)

    assert mind.frames == {77: 3}
    speed_m_s = command.left_wheel_rad_s * WHEEL_RADIUS_M
    assert round(speed_m_s / robot.COUNTED_M_S) == 77
