"""An agent's paths beside the true one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.evaluation.paths import Errors, Paths
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import SelfMotion
from tests.support.world.paths import (
    TICK_NS,
    TICK_S,
    estimate,
    odometry,
    self_motion,
    straight_drive,
    true_pose,
)


def driven(ticks: int) -> Paths:
    """The paths of a straight drive that the wheels measure without error."""
    paths = Paths()
    straight_drive(paths, ticks, wheel_speed_m_s=1.0)
    return paths


def errors_of_a_second() -> Errors:
    """Of a second at 1 m/s: wheels that measure a fifth more, fused self-motion that measures a
    tenth less, and two estimates.
    """
    paths = Paths()
    straight_drive(paths, 20, wheel_speed_m_s=1.2, fused_speed_m_s=0.9)
    paths.update(estimate(10, 0.5, 0.03))
    paths.update(estimate(20, 1.0, -0.05))
    return paths.errors()


def test_errors_are_distances_from_the_truth_of_the_same_stamp() -> None:
    errors = errors_of_a_second()

    assert errors.stamps_ns.tolist() == [10 * TICK_NS, 20 * TICK_NS]
    assert errors.estimate_m == pytest.approx([0.03, 0.05])
    assert errors.wheels_m == pytest.approx([0.1, 0.2])
    assert errors.fused_m == pytest.approx([0.05, 0.1])


def test_the_estimate_is_compared_with_wheels_and_with_fused_self_motion() -> None:
    errors = errors_of_a_second()

    assert errors.over_wheels == pytest.approx(0.04 / 0.15)
    assert errors.over_fused == pytest.approx(0.04 / 0.075)


def test_truth_between_two_poses_is_interpolated() -> None:
    paths = Paths()
    paths.update(true_pose(0, 0.0, 0.0))
    paths.update(true_pose(4, 4.0, 8.0))
    for tick in (1, 4):
        paths.update(odometry(tick, 0.0))
        paths.update(self_motion(tick, 0.0))

    paths.update(estimate(3, 3.0, 6.0))

    assert paths.errors().estimate_m == pytest.approx([0.0])


def test_an_estimate_that_no_truth_surrounds_does_not_count() -> None:
    paths = driven(4)
    paths.update(estimate(5, 0.25, 0.0))
    errors = paths.errors()

    assert errors.stamps_ns.size == 0
    assert errors.over_wheels is None
    assert errors.over_fused is None


def test_the_last_of_several_estimates_of_one_stamp_counts() -> None:
    paths = driven(4)
    paths.update(estimate(4, 9.0, 9.0, version=1))
    paths.update(estimate(4, 0.2, 0.0, version=2))

    assert paths.errors().estimate_m == pytest.approx([0.0], abs=1e-12)


def test_a_pose_that_is_corrected_later_counts_for_its_own_time() -> None:
    paths = driven(ticks=20)
    paths.update(estimate(10, 0.5, 0.3))
    paths.update(estimate(10, 0.5, 0.1, version=2, committed_tick=18))

    errors = paths.errors()

    assert errors.stamps_ns.tolist() == [10 * TICK_NS]
    assert errors.estimate_m.tolist() == pytest.approx([0.1])


def test_the_agents_frame_starts_in_the_first_true_pose() -> None:
    paths = Paths()
    paths.update(true_pose(0, 5.0, -2.0, math.pi / 2))
    paths.update(true_pose(1, 5.0, -1.0, math.pi / 2))
    ahead, left = paths.to_world(np.array([[1.0, 0.0], [0.0, 2.0]]))

    assert ahead == pytest.approx([5.0, -1.0])
    assert left == pytest.approx([3.0, -2.0])


def test_path_integration_of_a_circle_by_midpoints_closes_it() -> None:
    steps = 200
    circumference_m = steps * TICK_S
    turn_rate_rad_s = math.tau / circumference_m
    paths = Paths()
    paths.update(true_pose(0, 0.0, 0.0))
    for tick in range(1, steps + 1):
        paths.update(odometry(tick, 1.0, turn_rate_rad_s))
        paths.update(self_motion(tick, 1.0, turn_rate_rad_s))

    diameter_m = circumference_m / math.pi
    for path_m in (paths.wheels_path_m, paths.fused_path_m):
        assert path_m[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert path_m[:, 1].max() == pytest.approx(diameter_m, rel=1e-3)


def test_a_repeated_motion_moves_nothing() -> None:
    paths = Paths()
    straight_drive(paths, 4, wheel_speed_m_s=1.0)
    before_m = [paths.wheels_path_m, paths.fused_path_m]
    paths.update(odometry(4, 1.0))
    paths.update(self_motion(4, 1.0))

    for path_m, after_m in zip(before_m, [paths.wheels_path_m, paths.fused_path_m], strict=True):
        assert after_m == pytest.approx(path_m)


def test_self_motion_without_its_five_columns_is_refused() -> None:
    three_columns = Array.of([[1.0, 0.0, 0.05]], "<f8")
    motion = SelfMotion(frame=1, since_ns=0, motions=three_columns)

    with pytest.raises(MessageError, match=r"it needs \(n, 5\)"):
        Paths().update(motion)


def test_errors_of_heading_are_differences_from_the_true_one_the_shorter_way() -> None:
    paths = Paths()
    turned_rad = math.pi - 0.1
    paths.update(true_pose(0, 0.0, 0.0, turned_rad))
    paths.update(self_motion(1, 0.0, turn_rate_rad_s=4.0))
    paths.update(true_pose(2, 0.0, 0.0, -turned_rad))
    paths.update(estimate(1, 0.0, 0.0, heading_rad=0.3))

    errors = paths.errors()

    assert errors.poses[0, 2] == pytest.approx(math.pi)
    assert errors.estimate_rad == pytest.approx([0.2])
    assert errors.fused_rad == pytest.approx([0.1])
    assert errors.wheels_rad.size == 0
