"""What the launcher knows of a drive."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from cogmap.cli.launch.observer import Observer
from cogmap.schemas.cognition import Competition
from cogmap.schemas.graph import Delta, DropNode, Operation, Phase
from cogmap.schemas.nodes import ROOT_MAP, Goal, Map
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import Pose, TruePose
from tests.support.world.paths import (
    TICK_NS,
    TICK_S,
    estimate,
    self_motion,
    straight_drive,
    true_pose,
)
from tests.support.world.plans import plan_along
from tests.support.world.scenes import thing


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


def test_it_is_told_after_how_far_a_map_was_recalled() -> None:
    observer = Observer()
    straight_drive(observer, 20, wheel_speed_m_s=1.0)
    assert observer.recalled_m is None

    observer.update(given(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:1")))
    straight_drive(observer, 40, wheel_speed_m_s=1.0)
    assert observer.recalled_m == 1.0


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
    observer = Observer()
    straight_drive(observer, 4, wheel_speed_m_s=1.0)
    observer.update(Competition(stamp_ns=4, cycle=1, contenders=[]))
    observer.update(Delta(version=1, cycle=1, phase=Phase.OBJECTS, operations=[thing("x")]))

    assert len(observer.estimated_path_m) == 0


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
