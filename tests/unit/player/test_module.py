"""The player as a module, in lockstep and in real time."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.bus.codec import encode
from cogmap.errors import ConfigError, UsageError
from cogmap.runtime.module import Module
from cogmap.runtime.repetition import CHECK_NS, REPEAT_AFTER_NS
from cogmap.runtime.run import LOCKSTEP, REAL_TIME, Run
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock, Pause, Paused, Playback
from cogmap.schemas.sensing import MotorCommand, Percepts, StereoFrame, TrueTown
from cogmap.services.player.lockstep import Lockstep
from cogmap.services.player.module import Config, build
from cogmap.services.player.playhead import Playhead
from cogmap.services.player.real_time import LAST_ANSWER_NS, PERIOD_NS, RealTime
from cogmap.services.player.recording import LEAD_NS
from cogmap.testing import PERIOD_NS as VIEW_PERIOD_NS
from cogmap.testing import of_type, stamp_ns
from tests.support.recordings import Walk, kitti_folder

START_NS = 10**12


def _command(at_ns: int) -> MotorCommand:
    return MotorCommand(stamp_ns=at_ns, left_wheel_rad_s=3.0, right_wheel_rad_s=3.0)


def _kitti(tmp_path: Path, run: Run = LOCKSTEP, pairs: int = 3) -> Module:
    folder = kitti_folder(tmp_path / "07", pairs)
    return build(Config(recording=f"kitti:{folder}"), run=run)


def _answered(module: Module) -> list[Message]:
    """All that is played in lockstep where each view is answered."""
    assert module.start is not None
    messages = module.stamp(module.start())
    while not isinstance(messages[-1], Playback):
        messages += module.feed(_command(messages[-1].stamp_ns))
    return messages


def test_lockstep_plays_a_view_for_each_answer_and_then_says_that_it_is_over(
    tmp_path: Path,
) -> None:
    messages = _answered(_kitti(tmp_path))

    frames = of_type(StereoFrame, messages)
    assert [frame.frame for frame in frames] == [0, 1, 2]
    assert [frame.stamp_ns for frame in frames] == [
        LEAD_NS,
        LEAD_NS + 100_000_000,
        LEAD_NS + 200_000_000,
    ]
    assert frames[0].left.shape == (48, 64)
    assert {clock.rate for clock in of_type(Clock, messages)} == {0.0}
    played = of_type(Playback, messages)
    assert [each.views for each in played] == [1, 2, 3, 3]
    assert [each.progress >= 1.0 for each in played] == [False, False, False, True]
    assert {each.recording for each in played} == {"kitti:07"}


def test_two_lockstep_plays_give_the_same_bytes(tmp_path: Path) -> None:
    first = _answered(_kitti(tmp_path / "one"))
    second = _answered(_kitti(tmp_path / "two"))

    assert [encode(message) for message in first] == [encode(message) for message in second]


def test_lockstep_ignores_what_answers_another_view_and_all_after_the_end() -> None:
    lockstep = Lockstep(Playhead(Walk(1), "test:walk"))
    lockstep.on_start()

    assert lockstep.on_command(_command(stamp_ns(5))) is None
    end = lockstep.on_command(_command(stamp_ns(0)))
    assert end is not None
    assert of_type(Playback, end)[0].progress == 1.0
    assert lockstep.on_command(_command(stamp_ns(0))) is None
    assert lockstep.on_timer(10 * REPEAT_AFTER_NS) == []


def test_lockstep_repeats_a_view_that_nobody_answers_but_no_truth() -> None:
    lockstep = Lockstep(Playhead(Walk(2), "test:walk"))
    first = lockstep.on_start()

    repeated: list[Message] = []
    for tick in range(REPEAT_AFTER_NS // CHECK_NS + 1):
        repeated += lockstep.on_timer(START_NS + tick * CHECK_NS)

    assert repeated == [message for message in first if message in repeated]
    assert len(of_type(Clock, repeated)) == 1
    assert of_type(Playback, repeated) == []
    assert repeated[-1].stamp_ns == stamp_ns(0)


def test_an_end_without_any_view_that_can_be_read_is_an_end() -> None:
    lockstep = Lockstep(Playhead(Walk(2, broken=[0, 1]), "test:walk"))

    (end,) = of_type(Playback, lockstep.on_start())

    assert (end.progress, end.views, end.skipped) == (1.0, 0, 2)


def _in_real_time(
    real_time: RealTime, seconds: float, answers: bool = True, since_ns: int = START_NS
) -> list[Message]:
    messages: list[Message] = []
    for tick in range(round(seconds * 1e9 / PERIOD_NS)):
        new = real_time.on_timer(since_ns + tick * PERIOD_NS)
        messages += new
        for view in of_type(Percepts, new):
            if answers:
                real_time.on_command(_command(view.stamp_ns))
    return messages


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_in_real_time_views_come_as_they_were_recorded_some_times_as_fast(speed: float) -> None:
    real_time = RealTime(Playhead(Walk(5), "test:walk"), speed)
    real_time.on_start()
    seconds = 2.5 * VIEW_PERIOD_NS / 1e9 / speed

    messages = _in_real_time(real_time, seconds)

    assert [view.frame for view in of_type(Percepts, messages)] == [0, 1, 2]
    clocks = of_type(Clock, messages)
    assert {clock.rate for clock in clocks} == {speed}
    passed_ns = clocks[-1].stamp_ns - clocks[0].stamp_ns
    assert passed_ns == pytest.approx(2.5 * VIEW_PERIOD_NS, abs=2 * PERIOD_NS * speed)


def test_in_real_time_nothing_is_played_before_the_others_are_ready() -> None:
    real_time = RealTime(Playhead(Walk(2), "test:walk"), 1.0)

    assert _in_real_time(real_time, 1.0) == []


def test_in_real_time_nothing_is_played_while_time_stands_but_step_by_step() -> None:
    real_time = RealTime(Playhead(Walk(5), "test:walk"), 1.0)
    real_time.on_start()
    before = _in_real_time(real_time, 0.1)
    real_time.on_pause(Pause(is_paused=True))
    stands = _in_real_time(real_time, 3.0, since_ns=START_NS + 1 * 3 * 10**9)
    real_time.on_pause(Pause(is_paused=True, views=2))
    steps = _in_real_time(real_time, 3.0, since_ns=START_NS + 2 * 3 * 10**9)
    real_time.on_pause(Pause(is_paused=False))
    after = _in_real_time(real_time, 3.0, since_ns=START_NS + 3 * 3 * 10**9)

    assert {type(message) for message in stands} == {Paused}
    assert [view.frame for view in of_type(Percepts, before)] == [0]
    assert [view.frame for view in of_type(Percepts, steps)] == [1, 2]
    assert [view.frame for view in of_type(Percepts, after)] == [3, 4]
    assert after[-1] == of_type(Playback, after)[-1]


def test_in_lockstep_the_next_view_waits_while_time_stands() -> None:
    lockstep = Lockstep(Playhead(Walk(2), "test:walk"))
    lockstep.on_start()
    lockstep.on_pause(Pause(is_paused=True))

    assert lockstep.on_command(_command(stamp_ns(0))) == []
    stepped = lockstep.on_pause(Pause(is_paused=True, views=1))
    assert [view.frame for view in of_type(Percepts, stepped)] == [1]
    assert lockstep.on_command(_command(stamp_ns(1))) == []
    (end,) = of_type(Playback, lockstep.on_pause(Pause(is_paused=False)))
    assert end.progress == 1.0


def test_in_real_time_it_is_over_when_the_last_view_is_answered() -> None:
    real_time = RealTime(Playhead(Walk(2), "test:walk"), 1.0)
    real_time.on_start()

    messages = _in_real_time(real_time, 1.0)

    ends = [each for each in of_type(Playback, messages) if each.progress >= 1.0]
    assert len(ends) == 1
    assert messages[-1] is ends[0]


def test_in_real_time_the_end_does_not_wait_for_an_answer_for_ever() -> None:
    real_time = RealTime(Playhead(Walk(1), "test:walk"), 1.0)
    real_time.on_start()

    messages = _in_real_time(real_time, LAST_ANSWER_NS / 1e9 + 1.0, answers=False)

    assert of_type(Playback, messages)[-1].progress == 1.0
    clock = of_type(Clock, messages)[-1]
    assert clock.stamp_ns >= stamp_ns(0) + LAST_ANSWER_NS - 2 * PERIOD_NS


def test_a_player_that_was_held_up_falls_behind_rather_than_hurry() -> None:
    real_time = RealTime(Playhead(Walk(50), "test:walk"), 1.0)
    real_time.on_start()
    real_time.on_timer(START_NS)

    messages = real_time.on_timer(START_NS + 5_000_000_000)

    assert len(of_type(Percepts, messages)) <= 2


def test_what_stood_there_is_published_again_for_those_who_join_later() -> None:
    real_time = RealTime(Playhead(Walk(50), "test:walk"), 1.0)
    real_time.on_start()

    assert len(of_type(TrueTown, _in_real_time(real_time, 6.0))) == 2


def test_in_a_long_gap_between_views_observers_know_that_time_passes() -> None:
    recording = Walk(2, gap_s=20.0)
    real_time = RealTime(Playhead(recording, "test:walk"), 1.0)
    real_time.on_start()

    played = of_type(Playback, _in_real_time(real_time, 15.0))

    assert [each.views for each in played] == [1, 1, 1]
    passed_s = [(each.stamp_ns - played[0].stamp_ns) / 1e9 for each in played]
    assert passed_s == pytest.approx([0.0, 5.0, 10.0], abs=0.1)


def test_in_a_simulated_run_the_player_does_nothing() -> None:
    module = build(Config(), run=Run(participants={"sim": 1}))

    assert module.start is None
    assert module.timers == []
    assert module.feed(_command(0)) == []


def test_a_player_without_a_recording_says_how_to_name_one() -> None:
    with pytest.raises(ConfigError, match="FORMAT:PATH"):
        build(Config(), run=Run(participants={"player": 1}))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("kiti:folder", "did you mean 'kitti'"),
        ("folder", "write it as FORMAT:PATH"),
        ("kitti:nowhere", "there is no folder nowhere"),
    ],
)
def test_a_recording_that_is_none_is_said(given: str, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        build(Config(recording=given), run=REAL_TIME)
