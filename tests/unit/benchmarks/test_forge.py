"""The campaign of lies: which there are, what is changed, and what is made of what follows."""

from __future__ import annotations

import pytest

from benchmarks.campaign.listener import Command, Place
from benchmarks.forge.cases import Case, Kind, Mode, every, kinds_of, selected
from benchmarks.forge.lies import FAR_NS, LIE, STRANGER, TURN_RAD, in_time, lie
from benchmarks.forge.measure import metrics
from benchmarks.forge.outcome import (
    Outcome,
    flowing_after_s,
    longest_stand_s,
    slowest_m_s,
    usual_gap_s,
)
from cogmap.errors import UsageError
from cogmap.schemas import topics
from cogmap.schemas.codelets import Proposal, Task
from cogmap.schemas.cognition import Action
from cogmap.schemas.examples import example
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import MotorCommand, Pose, TruePose

ALL = every(list(Mode))
CASE = Case("clock", Kind.FAR_STAMP, Mode.LOCKSTEP)


def _commands(*times_s: float, moves: bool = True) -> list[Command]:
    return [Command(time_s, moves) for time_s in times_s]


def test_a_lie_about_a_version_is_told_only_where_there_is_one() -> None:
    subjects = {case.subject for case in ALL if case.kind is Kind.FAR_VERSION}

    assert topics.DELTA.name in subjects
    assert topics.CLOCK.name not in subjects


def test_what_people_may_publish_is_no_lie_under_another_name() -> None:
    kinds = {case.kind for case in ALL if case.subject == topics.PAUSE.name}

    assert Kind.FAR_STAMP in kinds
    assert not kinds & {Kind.OTHER_SOURCE, Kind.NEW_INCARNATION}


def test_cases_are_drawn_by_their_seed_and_keep_their_order() -> None:
    drawn = selected(ALL, 12, seed=5, only=())

    assert drawn == selected(ALL, 12, seed=5, only=())
    assert drawn != selected(ALL, 12, seed=6, only=())
    assert [ALL.index(case) for case in drawn] == sorted(ALL.index(case) for case in drawn)


def test_cases_are_chosen_by_topic_by_kind_and_by_both() -> None:
    assert selected(ALL, None, 1, ["clock/far-stamp/lockstep"]) == [CASE]
    assert {case.mode for case in selected(ALL, None, 1, ["clock/far-stamp"])} == set(Mode)
    assert {case.kind for case in selected(ALL, None, 1, ["/flood"])} == {Kind.FLOOD}
    with pytest.raises(UsageError, match="clocks: no case has that name"):
        selected(ALL, None, 1, ["clocks"])


@pytest.mark.parametrize("kind", kinds_of(topics.DELTA))
def test_a_lie_is_told_in_the_name_of_the_source_but_for_another_one(kind: Kind) -> None:
    true = example(topics.DELTA)
    is_own = lie(kind, true, number=8, told=0).source == true.source

    assert is_own == (kind not in (Kind.OTHER_SOURCE, Kind.FLOOD))


def test_a_far_stamp_is_all_that_is_changed_of_a_message() -> None:
    true = example(topics.PERCEPTS)
    told = lie(Kind.FAR_STAMP, true, number=true.seq, told=0)

    changed = [
        name for name in true.__struct_fields__ if getattr(told, name) != getattr(true, name)
    ]
    assert changed == ["stamp_ns"]
    assert told.stamp_ns == FAR_NS


def test_a_lie_about_what_moves_the_robot_commands_what_the_agent_would_not() -> None:
    command = lie(Kind.OTHER_SOURCE, example(topics.MOTOR_COMMAND), 0, 0)
    action = lie(Kind.OTHER_SOURCE, example(topics.ACTION), 0, 0)

    assert isinstance(command, MotorCommand)
    assert command.left_wheel_rad_s == command.right_wheel_rad_s < 0
    assert isinstance(action, Action)
    assert action.parameters == {"turn_rad": TURN_RAD}
    assert action.source == STRANGER


def test_a_proposal_answers_the_newest_task_with_nothing() -> None:
    task = example(topics.TASK)
    assert isinstance(task, Task)
    told = in_time(example(topics.PROPOSAL), 0, task)

    assert isinstance(told, Proposal)
    assert (told.task_id, told.codelet, told.operations) == (task.task_id, task.codelet, [])


def test_a_delta_continues_the_newest_version_with_a_node_of_the_liars_own() -> None:
    true = example(topics.DELTA)
    assert isinstance(true, Delta)
    told = lie(Kind.NEW_INCARNATION, in_time(true, 0, None), 0, 0)

    assert isinstance(told, Delta)
    assert told.version == true.version + 1
    assert told.operations == [*true.operations, LIE]


def test_an_agent_stands_until_a_command_turns_its_wheels() -> None:
    commands = [*_commands(0.2, 0.4), *_commands(2.0, 3.0, moves=False), *_commands(9.0)]

    assert longest_stand_s(commands, last_lie_s=0.0, now_s=9.5) == pytest.approx(8.6)


def test_commands_flow_again_after_the_last_long_gap() -> None:
    steady_s = [number / 10 for number in range(-10, 3)]
    again_s = [3.0 + number / 10 for number in range(10)]
    gap_s = usual_gap_s(_commands(*steady_s))

    assert gap_s == pytest.approx(0.1)
    assert flowing_after_s(_commands(*steady_s), 0.0, 3.0, gap_s) is None
    assert flowing_after_s(_commands(*steady_s, *again_s), 0.0, 4.0, gap_s) == 3.0


def test_the_speed_backwards_is_along_the_heading_that_the_robot_had() -> None:
    places = [
        Place(0.0, TruePose(stamp_ns=stamp_ns, pose=pose, travelled_m=0.0, progress=0.0))
        for stamp_ns, pose in (
            (0, Pose(x_m=0.0, y_m=0.0, heading_rad=0.0)),
            (100_000_000, Pose(x_m=0.3, y_m=0.0, heading_rad=0.0)),
            (200_000_000, Pose(x_m=0.1, y_m=0.0, heading_rad=0.0)),
        )
    ]

    assert slowest_m_s(places) == pytest.approx(-2.0)


def test_a_case_that_ended_the_drive_is_stopped_and_its_graph_is_not_compared() -> None:
    ended = Outcome(CASE, ended=True, named_by=["output: the time is over"])
    fine = Outcome(CASE, recovered_s=0.5, named_by=["motor.log: rejected clock"])
    forked = Outcome(CASE, recovered_s=0.5, is_forked=True)

    assert ended.failures == ["stopped for good"]
    assert not fine.failures
    assert forked.failures == ["forked unsaid", "unnamed"]
    assert not forked.is_clean
    measured = metrics([ended, fine, forked], chosen=5)
    assert measured["stopped_for_good"] == measured["forked_unsaid"] == measured["unnamed"] == 1
    assert measured["cases_left_out"] == 2
