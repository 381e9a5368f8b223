"""What the robot passed a moment ago: arcs that lead into it are replaced."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import RangeScan, SelfMotion
from cogmap.services.motor.reactive.near import NearObstacles

CLEARANCE_M = 0.7
STEP_NS = 200_000_000
BEARINGS_RAD = np.linspace(0.6, -0.6, 33).astype(np.float32)
POST_M = (6.0, 1.2)


class Robot:
    """A robot that drives along x from the origin, past a post that its scan sees while it is
    ahead.
    """

    def __init__(self, post_m: tuple[float, float] | None = POST_M) -> None:
        self.near = NearObstacles(CLEARANCE_M)
        self._post_m = post_m
        self._wall_m: float | None = None
        self._x_m = 0.0
        self._now_ns = 0

    def drive(self, steps: int, step_m: float = 0.5, scan_first: bool = False) -> None:
        for _ in range(steps):
            self._x_m += step_m
            self._now_ns += STEP_NS
            if scan_first:
                self.near.on_scan(self._scan())
                self.near.on_motion(self._motion(step_m))
            else:
                self.near.on_motion(self._motion(step_m))
                self.near.on_scan(self._scan())

    def remove_post(self, behind_m: float) -> None:
        """From now on a wall across the way, that far ahead, is seen where the post was."""
        self._post_m = None
        self._wall_m = self._x_m + behind_m

    def _motion(self, step_m: float) -> SelfMotion:
        row = [step_m / 0.2, 0.0, 0.2, 0.0, 0.0]
        return SelfMotion(
            stamp_ns=self._now_ns,
            frame=self._now_ns // STEP_NS,
            since_ns=self._now_ns - STEP_NS,
            motions=Array.of(np.array([row])),
        )

    def _scan(self) -> RangeScan:
        range_m = np.zeros(len(BEARINGS_RAD), np.float32)
        if self._wall_m is not None:
            range_m = (self._wall_m - self._x_m) / np.cos(BEARINGS_RAD)

        if self._post_m is not None:
            ahead_m = self._post_m[0] - self._x_m
            bearing_rad = math.atan2(self._post_m[1], ahead_m)
            sector = int(np.abs(BEARINGS_RAD - bearing_rad).argmin())
            if abs(BEARINGS_RAD[sector] - bearing_rad) < 0.03:
                range_m[sector] = math.hypot(ahead_m, self._post_m[1])

        return RangeScan(
            stamp_ns=self._now_ns,
            frame=self._now_ns // STEP_NS,
            bearing_rad=Array.of(BEARINGS_RAD),
            range_m=Array.of(range_m),
        )


def _standing(scan: RangeScan) -> SelfMotion:
    """No motion until the view of a scan."""
    return SelfMotion(
        stamp_ns=scan.stamp_ns,
        frame=scan.frame,
        since_ns=scan.stamp_ns - STEP_NS,
        motions=Array.of(np.zeros((0, 5))),
    )


def _turn(near: NearObstacles, per_m: float) -> float:
    curvature_per_m = near.clear_curvature(per_m)
    assert curvature_per_m is not None
    return curvature_per_m


def test_where_nothing_is_near_the_robot_turns_as_it_wants() -> None:
    assert _turn(Robot().near, 0.8) == 0.8


def test_the_robot_does_not_turn_into_what_it_does_not_see_any_longer() -> None:
    robot = Robot()
    robot.drive(10)

    assert _turn(robot.near, 0.9) < 0.6
    assert _turn(robot.near, 0.0) == 0.0
    assert _turn(robot.near, -0.9) == -0.9


def test_a_scan_may_come_before_the_motion_to_its_view() -> None:
    one = Robot()
    one.drive(10)
    other = Robot()
    other.drive(10, scan_first=True)

    assert _turn(other.near, 0.9) == _turn(one.near, 0.9)


def test_what_is_behind_the_robot_is_forgotten() -> None:
    robot = Robot()
    robot.drive(11)
    robot.drive(20)

    assert _turn(robot.near, 0.9) == 0.9


def test_a_hit_of_one_scan_alone_is_noise() -> None:
    robot = Robot()
    robot.drive(1, step_m=3.0)
    robot._post_m = None
    robot.drive(5)

    assert _turn(robot.near, 0.9) == 0.9


def test_what_a_later_scan_sees_through_is_forgotten() -> None:
    robot = Robot((6.0, 0.0))
    robot.drive(5)
    robot.remove_post(behind_m=9.0)
    robot.drive(6, step_m=0.1)

    assert _turn(robot.near, 0.0) == 0.0


def test_between_obstacles_on_all_sides_no_arc_is_clear() -> None:
    near = NearObstacles(clearance_m=2.0)
    for number in range(4):
        bearings_rad = np.linspace(2.5, -2.5, 60).astype(np.float32)
        scan = RangeScan(
            stamp_ns=(number + 1) * STEP_NS,
            frame=number,
            bearing_rad=Array.of(bearings_rad),
            range_m=Array.of(np.full(60, 2.65, np.float32)),
        )
        near.on_motion(_standing(scan))
        near.on_scan(scan)

    assert near.clear_curvature(0.0) is None


@pytest.mark.parametrize("per_m", [0.5, -0.5])
def test_the_arc_that_is_taken_is_the_nearest_to_the_one_wanted(per_m: float) -> None:
    robot = Robot((6.0, math.copysign(1.0, per_m)))
    robot.drive(10)
    taken_per_m = _turn(robot.near, per_m)

    assert 0 <= taken_per_m / per_m < 1.0


class Wall:
    """A wall on the left of a robot, along its way, and a view of it."""

    def __init__(self, left_m: float, ends_m: float) -> None:
        with np.errstate(divide="ignore"):
            on_wall_m = np.where(BEARINGS_RAD > 0, left_m / np.sin(BEARINGS_RAD), np.inf)

        is_hit = on_wall_m * np.cos(BEARINGS_RAD) <= ends_m
        self.range_m = np.where(is_hit, on_wall_m, 30.0).astype(np.float32)
        self.last_hit_m = float((self.range_m * np.cos(BEARINGS_RAD))[is_hit].max())
        self._end_m = np.array([ends_m, left_m])

    def distance_m(self, from_m: float, per_m: float) -> float:
        """How near to the wall's end an arc leads."""
        along_m = np.linspace(0.0, 2.0, 50)
        x_m = from_m + np.sin(per_m * along_m) / per_m
        y_m = (1 - np.cos(per_m * along_m)) / per_m
        return float(np.hypot(x_m - self._end_m[0], y_m - self._end_m[1]).min())


def _show(near: NearObstacles, range_m: Floats, first: int, scans: int) -> None:
    for number in range(first, first + scans):
        scan = RangeScan(
            stamp_ns=(number + 1) * STEP_NS,
            frame=number,
            bearing_rad=Array.of(BEARINGS_RAD),
            range_m=Array.of(range_m.astype(np.float32)),
        )
        near.on_motion(_standing(scan))
        near.on_scan(scan)


def _drive_on(near: NearObstacles, number: int, forward_m: float) -> None:
    row = [forward_m / 0.2, 0.0, 0.2, 0.0, 0.0]
    motion = SelfMotion(
        stamp_ns=(number + 1) * STEP_NS,
        frame=number,
        since_ns=number * STEP_NS,
        motions=Array.of(np.array([row])),
    )
    near.on_motion(motion)


def test_a_surface_may_reach_to_the_ray_that_passes_it() -> None:
    near = NearObstacles(CLEARANCE_M)
    wall = Wall(left_m=2.0, ends_m=4.55)
    assert wall.last_hit_m < 4.2
    _show(near, wall.range_m, first=0, scans=3)
    _drive_on(near, 3, forward_m=3.5)

    widest_per_m = _turn(near, 1.0)
    assert wall.distance_m(3.5, widest_per_m) >= CLEARANCE_M - 0.05


@pytest.mark.parametrize(("seen_from", "is_kept"), [(17, True), (19, False)])
def test_what_was_seen_is_forgotten_where_rays_pass_it_on_both_sides(
    seen_from: int, is_kept: bool
) -> None:
    near = NearObstacles(CLEARANCE_M)
    post_m = np.full(len(BEARINGS_RAD), 20.0)
    post_m[16] = 4.0
    _show(near, post_m, first=0, scans=3)

    passed_m = np.full(len(BEARINGS_RAD), 20.0)
    passed_m[seen_from:] = 4.0
    _show(near, passed_m, first=3, scans=1)
    _drive_on(near, 4, forward_m=2.0)
    is_left_clear = _turn(near, 0.15) == 0.15
    assert is_left_clear is not is_kept


def test_a_robot_that_stands_notices_what_appears_and_keeps_what_is_there() -> None:
    near = NearObstacles(CLEARANCE_M)
    free_m = np.full(len(BEARINGS_RAD), 20.0)
    _show(near, free_m, first=0, scans=30)
    post_m = free_m.copy()
    post_m[16] = 3.0
    _show(near, post_m, first=30, scans=3)
    _show(near, np.zeros(len(BEARINGS_RAD)), first=33, scans=4)
    _drive_on(near, 37, forward_m=1.5)

    assert _turn(near, 0.0) != 0.0


def test_a_robot_that_stands_for_long_remembers_a_few_scans() -> None:
    near = NearObstacles(CLEARANCE_M)
    wall_m = np.full(len(BEARINGS_RAD), 4.0)
    _show(near, wall_m, first=0, scans=10)
    after_ten = len(near._points_m)
    _show(near, wall_m, first=10, scans=50)

    assert len(near._points_m) == after_ten


@pytest.mark.parametrize(("rays", "is_avoided"), [(2, True), (1, False)])
def test_what_is_first_seen_too_near_for_a_range_is_avoided_at_once(
    rays: int, is_avoided: bool
) -> None:
    near = NearObstacles(CLEARANCE_M)
    beside_m = np.full(len(BEARINGS_RAD), 20.0)
    beside_m[:rays] = 2.5
    _show(near, beside_m, first=0, scans=1)

    assert (_turn(near, 0.6) < 0.4) is is_avoided
    assert _turn(near, -0.3) == -0.3


def test_what_was_seen_from_farther_is_where_it_was_seen() -> None:
    near = NearObstacles(CLEARANCE_M)
    ahead_m = np.full(len(BEARINGS_RAD), 20.0)
    ahead_m[3:6] = 4.0
    _show(near, ahead_m, first=0, scans=3)
    _drive_on(near, 3, forward_m=1.7)
    size = len(near._points_m)

    close_m = np.full(len(BEARINGS_RAD), 20.0)
    close_m[:3] = 2.5
    _show(near, close_m, first=4, scans=1)
    assert len(near._points_m) == size
