"""Wheel speeds that follow a route, and the obstacles that stop them."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.robot import CLEARANCE_M, HALF_WIDTH_M, TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import MotorCommand, Pose, RangeScan, SpeedLimit
from cogmap.services.motor.aim import Aim
from cogmap.services.motor.config import Config
from cogmap.services.motor.motor import SensoryMotorMemory, obstacle_ahead_m
from cogmap.services.motor.programs import FollowPlan
from cogmap.services.motor.reactive.near import NearObstacles
from cogmap.services.motor.route import LOOKAHEAD_M, SMOOTHED_M
from tests.support.world.plans import Point, plan_along


def _scan(*obstacles: tuple[float, float]) -> RangeScan:
    bearing_rad, range_m = np.array(obstacles, np.float32).reshape(-1, 2).T
    return RangeScan(
        frame=1,
        bearing_rad=Array.of(bearing_rad),
        range_m=Array.of(range_m),
    )


def _command(
    pose: Pose,
    clear_m: float = math.inf,
    corners: tuple[Point, ...] = ((0.0, 0.0), (50.0, 0.0)),
    age_s: float = 0.0,
) -> MotorCommand:
    """The command on a straight drive so far along the route."""
    config = Config()
    program = FollowPlan(config)
    program.take(plan_along(*corners), _at())
    for x_m in np.arange(0.0, pose.x_m, 1.0):
        program.aim(_at(x_m))
    aim = program.aim(pose)
    assert isinstance(aim, Aim)

    motor = SensoryMotorMemory(config, NearObstacles(HALF_WIDTH_M))
    return motor.command(7, aim, clear_m, round(age_s * 1e9))


def _at(x_m: float = 0.0, y_m: float = 0.0, heading_rad: float = 0.0) -> Pose:
    return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def test_on_the_line_and_along_it_both_wheels_turn_at_cruising_speed() -> None:
    command = _command(_at(5.0))
    config = Config()

    assert (
        command.left_wheel_rad_s == command.right_wheel_rad_s == config.cruise_m_s / WHEEL_RADIUS_M
    )
    assert (command.halted_by, command.stamp_ns) == ("", 7)


@pytest.mark.parametrize("pose", [_at(5.0, 1.0), _at(5.0, 0.0, 0.3), _at(5.0, 0.5, 2 * math.pi)])
def test_left_of_the_line_or_headed_left_the_robot_turns_right(pose: Pose) -> None:
    command = _command(pose)

    assert command.left_wheel_rad_s > command.right_wheel_rad_s


@pytest.mark.parametrize(
    "pose", [_at(5.0, -1.0), _at(5.0, 0.0, -0.3), _at(5.0, -0.5, -4 * math.pi)]
)
def test_right_of_the_line_or_headed_right_the_robot_turns_left(pose: Pose) -> None:
    command = _command(pose)

    assert command.left_wheel_rad_s < command.right_wheel_rad_s


def test_a_robot_that_looks_backwards_turns_on_the_spot() -> None:
    command = _command(_at(5.0, 0.0, 3.0))

    assert _driven(command) == pytest.approx(0.0)
    assert command.left_wheel_rad_s > command.right_wheel_rad_s


def test_before_an_obstacle_the_robot_turns_to_where_the_route_leads() -> None:
    command = _command(_at(5.0, 0.0, 1.0), clear_m=0.5)

    assert _driven(command) == pytest.approx(0.0)
    assert command.left_wheel_rad_s > command.right_wheel_rad_s


def test_the_arc_of_pure_pursuit_passes_through_the_point_ahead() -> None:
    command = _command(_at(10.0, 1.0))
    speed_m_s = (command.left_wheel_rad_s + command.right_wheel_rad_s) / 2 * WHEEL_RADIUS_M
    turn_rad_s = (command.right_wheel_rad_s - command.left_wheel_rad_s) * WHEEL_RADIUS_M / TRACK_M
    radius_m = speed_m_s / turn_rad_s
    centre = (10.0, 1.0 + radius_m)

    assert math.dist(centre, (10.0 + LOOKAHEAD_M, 0.0)) == pytest.approx(abs(radius_m), rel=1e-6)


def test_the_robot_slows_down_before_a_bend() -> None:
    corners = ((0.0, 0.0), (50.0, 0.0), (50.0, 50.0))
    far_m_s = _driven(_command(_at(10.0), corners=corners))
    near_m_s = _driven(_command(_at(49.0), corners=corners))
    in_bend_m_s = math.sqrt(Config().lateral_m_s2 * SMOOTHED_M / (math.pi / 2))

    assert far_m_s == Config().cruise_m_s
    assert near_m_s < in_bend_m_s + 0.1


def test_the_robot_slows_down_on_an_arc_that_leads_it_back_to_a_straight_route() -> None:
    config = Config()
    command = _command(_at(10.0, 1.0))
    sides_rad_s = command.right_wheel_rad_s - command.left_wheel_rad_s
    turn_rad_s = abs(sides_rad_s) * WHEEL_RADIUS_M / TRACK_M

    assert command.slowed_by == SpeedLimit.BEND
    assert _driven(command) * turn_rad_s == pytest.approx(config.lateral_m_s2)


def _driven(command: MotorCommand) -> float:
    """The speed of the robot by a command, in m/s."""
    mean_rad_s = (command.left_wheel_rad_s + command.right_wheel_rad_s) / 2
    return mean_rad_s * WHEEL_RADIUS_M


def test_the_robot_slows_down_before_an_obstacle_and_stops_at_its_clearance() -> None:
    clearance_m = CLEARANCE_M
    clear_m = [clearance_m + free_m for free_m in (18.0, 2.5, 0.5)]
    speeds = [_driven(_command(_at(5.0), each_m)) for each_m in clear_m]

    assert speeds == sorted(speeds, reverse=True)
    assert speeds[0] == Config().cruise_m_s
    assert speeds[2] == pytest.approx(math.sqrt(2 * 2.5 * 0.5))

    stopped = _command(_at(5.0), clearance_m)

    assert (stopped.left_wheel_rad_s, stopped.right_wheel_rad_s, stopped.halted_by) == (
        0.0,
        0.0,
        "obstacle",
    )


@pytest.mark.parametrize("age_s", [0.0, 0.2])
def test_with_a_fresh_pose_the_robot_drives_at_full_speed(age_s: float) -> None:
    command = _command(_at(5.0), age_s=age_s)

    assert _driven(command) == Config().cruise_m_s
    assert command.slowed_by is SpeedLimit.NONE


@pytest.mark.parametrize("age_s", [0.5, 1.0])
def test_the_older_its_pose_the_slower_the_robot(age_s: float) -> None:
    command = _command(_at(5.0), age_s=age_s)

    assert _driven(command) == pytest.approx(Config().blind_m / age_s)
    assert command.slowed_by is SpeedLimit.POSE_AGE
    assert command.pose_age_ns == round(age_s * 1e9)


def test_a_pose_older_than_the_limit_halts_the_robot() -> None:
    command = _command(_at(5.0), age_s=2.1)

    assert _driven(command) == 0.0
    assert command.halted_by is SpeedLimit.POSE_AGE


def test_the_second_nearest_point_ahead_is_the_obstacle() -> None:
    ahead = _scan((0.0, 8.0), (0.05, 8.2))

    assert obstacle_ahead_m(ahead) == pytest.approx(8.2, abs=0.05)


@pytest.mark.parametrize(
    "points",
    [
        [(0.0, 8.0)],
        [(0.5, 8.0), (0.55, 8.0)],
        [(3.1, 8.0), (3.14, 8.0)],
        [(0.0, 0.0), (0.05, 0.0)],
    ],
    ids=["alone", "aside", "behind", "unknown range"],
)
def test_what_stands_aside_behind_or_alone_is_no_obstacle(
    points: list[tuple[float, float]],
) -> None:
    assert obstacle_ahead_m(_scan(*points)) == math.inf


def test_a_scan_whose_bearings_and_ranges_do_not_pair_is_refused() -> None:
    three_ranges = Array.of(np.ones(3, np.float32))
    scan = msgspec.structs.replace(_scan((0.0, 8.0), (0.1, 8.0)), range_m=three_ranges)

    with pytest.raises(MessageError, match="2,\\) bearings and \\(3"):
        obstacle_ahead_m(scan)
