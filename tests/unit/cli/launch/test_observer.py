"""What the launcher measures of a drive."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.cli.launch.observer import Errors, Observer
from cogmap.cli.launch.track import Track
from cogmap.errors import MessageError
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Competition
from cogmap.schemas.graph import Delta, DropNode, Operation, Phase
from cogmap.schemas.nodes import Goal
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import Odometry, Pose, SelfMotion, TruePose
from cogmap.testing import agent
from cogmap.testing import odometry as wheels
from tests.support.world.plans import plan_along
from tests.support.world.scenes import thing

TICK_NS = 50_000_000
TICK_S = 0.05


def true_pose(tick: int, x_m: float, y_m: float, heading_rad: float = 0.0) -> TruePose:
    pose = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
    return TruePose(stamp_ns=tick * TICK_NS, pose=pose, travelled_m=x_m, progress=0.5)


def odometry(tick: int, speed_m_s: float, turn_rate_rad_s: float = 0.0) -> Odometry:
    return wheels(0, speed_m_s, turn_rate_rad_s, stamp_ns=tick * TICK_NS, dt_s=TICK_S)


def estimate(
    tick: int, x_m: float, y_m: float, version: int = 1, committed_tick: int | None = None
) -> Delta:
    operations = [DropNode(id="object:inn"), agent(x_m=x_m, y_m=y_m, stamp_ns=tick * TICK_NS)]
    return Delta(
        stamp_ns=(tick if committed_tick is None else committed_tick) * TICK_NS,
        version=version,
        cycle=1,
        phase=Phase.LOCALIZATION,
        tasks=[],
        operations=operations,
    )


def self_motion(tick: int, speed_m_s: float, turn_rate_rad_s: float = 0.0) -> SelfMotion:
    """Of the two halves of one tick."""
    half = [speed_m_s, turn_rate_rad_s, 0.025, 0.1, 0.1]
    return SelfMotion(
        stamp_ns=tick * TICK_NS,
        frame=tick,
        since_ns=(tick - 1) * TICK_NS,
        motions=Array.of([half, half], "<f8"),
    )


def straight_drive(
    observer: Observer, ticks: int, wheel_speed_m_s: float, fused_speed_m_s: float = 1.0
) -> None:
    """1 m/s along x in truth."""
    observer.update(true_pose(0, 0.0, 0.0))
    for tick in range(1, ticks + 1):
        observer.update(odometry(tick, wheel_speed_m_s))
        observer.update(self_motion(tick, fused_speed_m_s))
        observer.update(true_pose(tick, TICK_S * tick, 0.0))


def driven(ticks: int) -> Observer:
    """An observer of a straight drive that the wheels measure without error."""
    observer = Observer()
    straight_drive(observer, ticks, wheel_speed_m_s=1.0)
    return observer


def errors_of_a_second() -> Errors:
    """Of a second at 1 m/s: wheels that measure a fifth more, fused self-motion that measures a
    tenth less, and two estimates.
    """
    observer = Observer()
    straight_drive(observer, 20, wheel_speed_m_s=1.2, fused_speed_m_s=0.9)
    observer.update(estimate(10, 0.5, 0.03))
    observer.update(estimate(20, 1.0, -0.05))
    return observer.errors()


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
    observer = Observer()
    observer.update(true_pose(0, 0.0, 0.0))
    observer.update(true_pose(4, 4.0, 8.0))
    for tick in (1, 4):
        observer.update(odometry(tick, 0.0))
        observer.update(self_motion(tick, 0.0))

    observer.update(estimate(3, 3.0, 6.0))

    assert observer.errors().estimate_m == pytest.approx([0.0])


def test_an_estimate_that_no_truth_surrounds_does_not_count() -> None:
    observer = driven(4)
    observer.update(estimate(5, 0.25, 0.0))
    errors = observer.errors()

    assert errors.stamps_ns.size == 0
    assert errors.over_wheels == 1.0
    assert errors.over_fused == 1.0


def test_the_last_of_several_estimates_of_one_stamp_counts() -> None:
    observer = driven(4)
    observer.update(estimate(4, 9.0, 9.0, version=1))
    observer.update(estimate(4, 0.2, 0.0, version=2))

    assert observer.errors().estimate_m == pytest.approx([0.0], abs=1e-12)


def test_a_pose_that_is_corrected_later_counts_for_its_own_time() -> None:
    observer = driven(ticks=20)
    observer.update(estimate(10, 0.5, 0.3))
    observer.update(estimate(10, 0.5, 0.1, version=2, committed_tick=18))

    errors = observer.errors()

    assert errors.stamps_ns.tolist() == [10 * TICK_NS]
    assert errors.estimate_m.tolist() == pytest.approx([0.1])


def test_the_agents_frame_starts_in_the_first_true_pose() -> None:
    observer = Observer()
    observer.update(true_pose(0, 5.0, -2.0, math.pi / 2))
    observer.update(true_pose(1, 5.0, -1.0, math.pi / 2))
    ahead, left = observer.to_world(np.array([[1.0, 0.0], [0.0, 2.0]]))

    assert ahead == pytest.approx([5.0, -1.0])
    assert left == pytest.approx([3.0, -2.0])


def test_path_integration_of_a_circle_by_midpoints_closes_it() -> None:
    steps = 200
    circumference_m = steps * TICK_S
    turn_rate_rad_s = math.tau / circumference_m
    observer = Observer()
    observer.update(true_pose(0, 0.0, 0.0))
    for tick in range(1, steps + 1):
        observer.update(odometry(tick, 1.0, turn_rate_rad_s))
        observer.update(self_motion(tick, 1.0, turn_rate_rad_s))

    diameter_m = circumference_m / math.pi
    for path_m in (observer.wheels_path_m, observer.fused_path_m):
        assert path_m[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert path_m[:, 1].max() == pytest.approx(diameter_m, rel=1e-3)


def test_a_repeated_motion_moves_nothing() -> None:
    observer = Observer()
    straight_drive(observer, 4, wheel_speed_m_s=1.0)
    before_m = [observer.wheels_path_m, observer.fused_path_m]
    observer.update(odometry(4, 1.0))
    observer.update(self_motion(4, 1.0))

    for path_m, after_m in zip(
        before_m, [observer.wheels_path_m, observer.fused_path_m], strict=True
    ):
        assert after_m == pytest.approx(path_m)


def test_self_motion_without_its_five_columns_is_refused() -> None:
    three_columns = Array.of([[1.0, 0.0, 0.05]], "<f8")
    motion = SelfMotion(frame=1, since_ns=0, motions=three_columns)

    with pytest.raises(MessageError, match=r"it needs \(n, 5\)"):
        Observer().update(motion)


def test_distance_progress_and_time_are_those_of_the_newest_pose() -> None:
    observer = Observer()
    straight_drive(observer, 20, wheel_speed_m_s=1.0)

    assert (observer.travelled_m, observer.progress, observer.elapsed_s) == (1.0, 0.5, 1.0)


def given(*operations: Operation) -> Delta:
    return Delta(version=1, cycle=1, phase=Phase.PERCEPTS, operations=[*operations])


def test_progress_is_the_share_of_the_goals_that_were_reached() -> None:
    observer = Observer()
    straight_drive(observer, 20, wheel_speed_m_s=1.0)
    names = ("a", "b", "c", "d")
    observer.update(given(*(Goal(id=name) for name in names)))
    assert (observer.progress, observer.goals) == (0.0, 4)

    observer.update(given(Goal(id="a", reached_ns=5), DropNode(id="d")))
    assert (observer.goals_reached, observer.goals) == (1, 3)
    assert observer.progress == pytest.approx(1 / 3)


def test_progress_grows_on_the_way_to_a_goal_and_is_whole_when_it_is_reached() -> None:
    plan = msgspec.structs.replace(plan_along((0.0, 0.0), (4.0, 0.0)), length_m=4.0)
    observer = Observer()
    observer.update(given(Goal(id="a"), plan))
    straight_drive(observer, 20, wheel_speed_m_s=1.0)
    assert observer.progress == pytest.approx(1 / 4)

    observer.update(true_pose(100, 5.0, 0.0))
    assert 0.8 < observer.progress < 1.0

    observer.update(given(Goal(id="a", reached_ns=5)))
    assert observer.progress == 1.0


def path_to_goal(observer: Observer) -> None:
    """30 m along x; then, with a goal, back to the middle and 20 m across."""
    line_m = [(x, 0.0) for x in range(31)]
    for tick, (x_m, y_m) in enumerate(line_m):
        observer.update(true_pose(tick, x_m, y_m))
        observer.update(estimate(tick, x_m, y_m))

    observer.update(given(Goal(id="a")))
    back_m = [(30.0 - x, 0.0) for x in range(16)]
    across_m = [(15.0, y) for y in range(1, 21)]
    for tick, (x_m, y_m) in enumerate([*back_m, *across_m], start=len(line_m)):
        observer.update(true_pose(tick, x_m, y_m))


def test_a_way_to_a_goal_is_a_shortcut_where_the_robot_was_not_before() -> None:
    observer = Observer()
    path_to_goal(observer)

    steps_m = observer.shortcuts_m
    assert np.abs(steps_m[0, 0] - (15.0, 8.0)).max() < 1e-9
    assert np.abs(steps_m[-1, 1] - (15.0, 20.0)).max() < 1e-9
    assert len(steps_m) == 12


def test_nothing_is_a_shortcut_where_the_goals_were_there_from_the_start() -> None:
    observer = Observer()
    observer.update(given(Goal(id="a")))
    straight_drive(observer, 20, wheel_speed_m_s=1.0)

    assert not len(observer.shortcuts_m)


def test_the_drive_has_ended_when_the_simulation_is_over() -> None:
    observer = Observer()
    straight_drive(observer, 20, wheel_speed_m_s=1.0)
    assert not observer.has_ended

    origin = Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)
    observer.update(TruePose(stamp_ns=9 * 10**9, pose=origin, travelled_m=1.0, progress=1.0))
    assert observer.has_ended


def test_other_messages_and_nodes_change_nothing() -> None:
    observer = driven(4)
    observer.update(Competition(stamp_ns=4, cycle=1, contenders=[]))
    observer.update(Delta(version=1, cycle=1, phase=Phase.OBJECTS, operations=[thing("x")]))

    assert len(observer.estimated_path_m) == 0


def test_a_track_keeps_its_order_when_an_old_position_comes_late() -> None:
    track = Track()
    for stamp_ns in (1, 3, 2):
        track.add(stamp_ns, float(stamp_ns), 0.0)

    covered = track.covers(np.arange(5))

    assert track.stamps_ns.tolist() == [1, 3]
    assert covered.tolist() == [False, True, True, True, False]


def playback(tick: int, progress: float, skipped: int = 0, *reasons: str) -> Playback:
    return Playback(
        stamp_ns=tick * TICK_NS,
        recording="kitti:07",
        views=tick + 1 - skipped,
        skipped=skipped,
        progress=progress,
        reasons=list(reasons),
    )


def test_a_recording_without_truth_is_followed_by_what_was_played() -> None:
    observer = Observer()
    assert not observer.has_begun

    observer.update(playback(0, 0.0))
    observer.update(self_motion(1, 1.0))
    observer.update(estimate(1, 0.05, 0.0))
    observer.update(playback(1, 0.5))

    assert observer.has_begun
    assert observer.start is None
    assert not observer.has_ended
    assert observer.progress == 0.5
    assert observer.elapsed_s == pytest.approx(TICK_S)
    assert observer.travelled_m == pytest.approx(TICK_S)
    assert observer.errors().estimate_m.size == 0
    assert observer.estimated_path_m.tolist() == [[0.05, 0.0]]


def test_what_could_not_be_played_is_kept_and_the_end_of_it_ends_the_drive() -> None:
    observer = Observer()
    observer.update(playback(0, 0.0))
    observer.update(playback(2, 1.0, 1, "000001.png is no whole picture"))

    assert observer.has_ended
    assert observer.played.recording == "kitti:07"
    assert (observer.played.views, observer.played.skipped) == (2, 1)
    assert list(observer.played.reasons) == ["000001.png is no whole picture"]


def test_a_truth_that_begins_late_in_a_recording_begins_where_path_integration_is_then() -> None:
    observer = Observer()
    observer.update(playback(0, 0.0))
    for tick in range(1, 9):
        observer.update(self_motion(tick, 1.0, turn_rate_rad_s=0.5))
        observer.update(playback(tick, 0.5))
        if tick == 4:
            observer.update(true_pose(tick, 5.0, 0.0, math.pi / 2))

    assert observer.fused_path_m[4] == pytest.approx([5.0, 0.0])
    ahead_m = observer.fused_path_m[5] - observer.fused_path_m[4]
    assert math.atan2(ahead_m[1], ahead_m[0]) == pytest.approx(math.pi / 2, abs=0.02)
