"""A recording is played view by view; what cannot be read is left out, counted and said."""

from __future__ import annotations

import pytest

from cogmap.schemas.base import Message
from cogmap.schemas.process import Playback
from cogmap.schemas.sensing import Odometry, Percepts, TruePose
from cogmap.services.player.playhead import Playhead, Step
from cogmap.testing import of_type, stamp_ns
from tests.support.recordings import Walk


def _played(recording: Walk) -> list[Step]:
    playhead = Playhead(recording, "test:walk")
    steps = []
    while (step := playhead.advance()) is not None:
        steps.append(step)
    return steps


def _sensed(steps: list[Step]) -> list[Message]:
    return [message for step in steps for message in (*step.before, *step.view)]


def test_each_view_comes_once_and_in_order_with_what_was_sensed_before_it() -> None:
    steps = _played(Walk(3))
    sensed = _sensed(steps)

    assert [view.frame for view in of_type(Percepts, sensed)] == [0, 1, 2]
    assert [step.stamp_ns for step in steps] == [stamp_ns(number) for number in range(3)]
    stamps_ns = [message.stamp_ns for message in sensed]
    assert stamps_ns == sorted(stamps_ns)
    assert len(of_type(Odometry, sensed)) == 3


def test_a_view_that_is_broken_is_left_out_counted_and_said() -> None:
    steps = _played(Walk(4, broken=[1, 2]))
    sensed = _sensed(steps)
    played = of_type(Playback, [message for step in steps for message in step.truth])

    assert [view.frame for view in of_type(Percepts, sensed)] == [0, 3]
    assert len(of_type(Odometry, sensed)) == 4, "the wheels are believed all the same"
    assert [each.skipped for each in played] == [0, 2]
    assert played[0].reasons == []
    assert played[1].reasons == [
        "view 1 is broken: copy it again",
        "view 2 is broken: copy it again",
    ]


def test_views_that_are_broken_at_the_end_are_said_when_it_is_over() -> None:
    playhead = Playhead(Walk(2, broken=[1]), "test:walk")
    assert playhead.advance() is not None
    assert playhead.advance() is None

    end = playhead.end()

    assert (end.views, end.skipped, end.progress) == (1, 1, 1.0)
    assert end.reasons == ["view 1 is broken: copy it again"]
    assert playhead.is_over


def test_observers_get_the_true_pose_where_it_is_known_and_nothing_is_invented() -> None:
    steps = _played(Walk(4, unknown=[1, 2]))
    true = of_type(TruePose, [message for step in steps for message in step.truth])

    assert [pose.pose.x_m for pose in true] == [0.0, 3.0]
    assert [pose.travelled_m for pose in true] == [0.0, 3.0]
    assert all(pose.progress < 1.0 for pose in true)


def test_after_a_restart_it_continues_with_the_next_view() -> None:
    recording = Walk(4, broken=[0])
    killed = Playhead(recording, "test:walk")
    first = killed.advance()
    assert first is not None

    restarted = Playhead(recording, "test:walk")
    restarted.resume(first.truth)
    following = restarted.advance()

    assert following is not None
    assert following.stamp_ns == stamp_ns(2)
    assert restarted.played().skipped == 1


def test_what_was_over_stays_over_after_a_restart() -> None:
    recording = Walk(1)
    killed = Playhead(recording, "test:walk")
    killed.advance()

    restarted = Playhead(recording, "test:walk")
    restarted.resume([killed.end()])

    assert restarted.is_over


def test_how_much_was_played_can_be_asked_again() -> None:
    playhead = Playhead(Walk(2), "test:walk")
    playhead.advance()

    assert playhead.played() == playhead.played()
    assert playhead.played().progress == pytest.approx(0.0)


def test_what_of_a_recording_is_not_played_is_said_once_in_the_beginning() -> None:
    steps = _played(Walk(2, notes=["3 observations of other robots are left out"]))
    first, second = of_type(Playback, [message for step in steps for message in step.truth])

    assert first.reasons == ["3 observations of other robots are left out"]
    assert second.reasons == []
    assert second.skipped == 0
