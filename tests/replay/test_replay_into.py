"""Replaying a small stateful module from a log gives the same bytes."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from cogmap.recording.storage.reader import LogReader
from cogmap.runtime.state.journal import Journal
from cogmap.schemas import topics
from tests.replay.mixer import Session, odometry, record, replay


def test_a_replay_feeds_inputs_in_the_order_of_causes_not_of_the_log(path: Path) -> None:
    record(path)
    times_ns = [record.log_time_ns for record in LogReader(path).records({topics.ODOMETRY})]
    assert times_ns == sorted(times_ns)

    report = replay(path)

    assert report.same
    assert report.speed > 0
    (outcome,) = report.outcomes
    assert outcome.fed == 60
    assert outcome.same == 41
    assert outcome.different == 0
    assert outcome.notes == []


def test_every_instance_is_replayed_by_itself(path: Path) -> None:
    record(path, instances=("mixer-1", "mixer-2"))

    report = replay(path)

    first, second = report.outcomes
    assert report.same
    assert (first.instance, first.same) == ("mixer-1", 41)
    assert (second.instance, second.same) == ("mixer-2", 41)


def test_processes_give_the_same_report_as_one(path: Path) -> None:
    record(path, instances=("mixer-1", "mixer-2"))

    one = replay(path, processes=1)
    two = replay(path, processes=2)

    assert len(one.outcomes) == 2
    for left, right in zip(one.outcomes, two.outcomes, strict=True):
        assert left.instance == right.instance
        assert left.same == right.same


def test_the_recorded_configuration_is_used_unless_it_is_overridden(path: Path) -> None:
    record(path, {"mixer": {"start": 5.0}})

    as_recorded = replay(path)
    overridden = replay(path, overrides={"mixer": {"start": 6.0}})

    assert as_recorded.same
    assert not overridden.same


def test_outputs_of_a_timer_are_replayed_with_its_time(path: Path) -> None:
    session = Session(path, {"mixer": {"timer": True}})
    shell = session.enter()
    session.publish(odometry(0), 1)
    session.settle()
    (timer,) = shell.module.timers
    run_timer = shell._timer(timer.handler)
    for seq in range(1, 8):
        run_timer(seq * 1_234_567)
        session.publish(odometry(seq), seq)
        session.settle()
    session.end()

    report = replay(path)

    assert report.same
    assert report.outcomes[0].same > 7


def test_a_restarted_module_is_replayed_from_what_its_journal_held(
    path: Path, tmp_path: Path
) -> None:
    session = Session(path)
    journal = tmp_path / "mixer.journal"
    for first in (0, 7, 14):
        shell = session.enter("mixer", Journal(journal))
        for seq in range(first, first + 7):
            session.publish(odometry(seq), seq)
        session.settle()
        shell.close()
    session.end()

    report = replay(path)

    assert report.same, report.first
    assert [outcome.incarnation for outcome in report.outcomes] == [0, 1, 2]


def test_inputs_from_a_restarted_source_are_told_apart_by_its_incarnation(path: Path) -> None:
    session = Session(path)
    session.enter()
    for incarnation in (1, 2):
        for seq in range(6):
            plain = odometry(seq)
            message = replace(plain, stamp_ns=plain.stamp_ns + incarnation)
            session.publish(message, 100 * incarnation + seq, incarnation)
        session.settle()
    session.end()

    report = replay(path)

    assert report.same, report.first
