"""Who counts as present among those that are to report their health."""

from __future__ import annotations

from cogmap.bus.interface import Member
from cogmap.runtime.heartbeats import FIRST_BEAT_S, SILENCE_S, START_S, Heartbeats

WORKER = Member("codelets", "codelets-1")
GHOST = Member("codelets", "ghost")
EPAM = Member("epam", "epam")
LATER_S = START_S + 1


def observed() -> Heartbeats:
    return Heartbeats({"codelets"}, began_s=0.0)


def test_a_module_that_need_not_report_counts_by_being_ready() -> None:
    heartbeats = observed()

    assert heartbeats.note(EPAM, True, LATER_S) == [(EPAM, True)]
    assert heartbeats.expire(LATER_S + 10 * SILENCE_S) == []
    assert heartbeats.note(EPAM, False, LATER_S) == [(EPAM, False)]


def test_a_worker_that_comes_later_counts_from_its_first_report_on() -> None:
    heartbeats = observed()

    assert heartbeats.note(WORKER, True, LATER_S) == []
    assert heartbeats.beat(WORKER, LATER_S + 0.5) == [(WORKER, True)]
    assert heartbeats.beat(WORKER, LATER_S + 1.5) == []


def test_a_report_that_comes_before_its_worker_counts_with_it() -> None:
    heartbeats = observed()

    assert heartbeats.beat(WORKER, LATER_S) == []
    assert heartbeats.note(WORKER, True, LATER_S + 0.1) == [(WORKER, True)]


def test_a_token_that_never_reports_never_counts_and_is_said() -> None:
    heartbeats = observed()

    assert heartbeats.note(GHOST, True, LATER_S) == []
    assert heartbeats.expire(LATER_S + 100) == []
    assert heartbeats.notes(LATER_S + 100) == [
        "codelets/ghost is on the bus and has reported no health at all: "
        "it gets no tasks until it does"
    ]
    assert heartbeats.note(GHOST, False, LATER_S + 101) == []
    assert heartbeats.notes(LATER_S + 102) == []


def test_those_that_start_together_count_at_once_for_a_while() -> None:
    heartbeats = observed()

    assert heartbeats.note(WORKER, True, 1.0) == [(WORKER, True)]
    assert heartbeats.note(GHOST, True, 1.0) == [(GHOST, True)]
    assert heartbeats.beat(WORKER, 2.0) == []
    assert heartbeats.expire(1.0 + FIRST_BEAT_S) == []
    assert heartbeats.expire(1.1 + FIRST_BEAT_S) == [(GHOST, False)]


def test_a_worker_that_falls_silent_is_dropped_said_and_used_again() -> None:
    heartbeats = observed()
    heartbeats.note(WORKER, True, 1.0)
    heartbeats.beat(WORKER, 2.0)

    assert heartbeats.expire(2.0 + SILENCE_S) == []
    assert heartbeats.expire(2.1 + SILENCE_S) == [(WORKER, False)]
    assert "codelets-1 is on the bus" in heartbeats.notes(2.2 + SILENCE_S)[0]

    assert heartbeats.beat(WORKER, 3.0 + SILENCE_S) == [(WORKER, True)]
    assert heartbeats.notes(3.1 + SILENCE_S) == []


def test_a_worker_that_was_dropped_and_leaves_does_not_leave_twice() -> None:
    heartbeats = observed()
    heartbeats.note(WORKER, True, 1.0)
    assert heartbeats.expire(2.0 + FIRST_BEAT_S) == [(WORKER, False)]

    assert heartbeats.note(WORKER, False, 6.0) == []
