"""Answers that come late by a slow link: the deadline follows, or health says what to set."""

from __future__ import annotations

import re
from itertools import count

from cogmap.runtime.notes import wrong_and_remedy
from cogmap.runtime.run import REAL_TIME
from cogmap.schemas.codelets import Assignment, Leases, Task
from cogmap.schemas.graph import Phase
from cogmap.testing import agent, of_type, stamp_ns
from tests.support.world.scenes import Desk, answer

MS = 1_000_000
CLOCK_MS = 50


def _drive(desk: Desk, delay_ms: int | None, views: int) -> None:
    """Views at their times, the clock each 50 ms, and answers `delay_ms` after their tasks; none
    with None.
    """
    due: list[tuple[int, Task]] = []
    shown = 0
    for now_ns in count(stamp_ns(0), CLOCK_MS * MS):
        desk.clock(now_ns)
        while due and due[0][0] <= now_ns:
            _, task = due.pop(0)
            moved = [agent(stamp_ns=task.stamp_ns)] if task.codelet == "localization" else []
            desk.feed(answer(task, moved))
        if now_ns >= stamp_ns(shown):
            desk.see(shown)
            shown += 1
        if shown > views:
            return
        if delay_ms is not None:
            due += [(now_ns + delay_ms * MS, task) for task in desk.take()]


def _in_time(desk: Desk) -> list[bool]:
    """Of each cycle that has ended, whether it has a localization."""
    localized = {delta.cycle for delta in desk.deltas if delta.phase is Phase.LOCALIZATION}
    return [delta.cycle in localized for delta in desk.deltas if delta.phase is Phase.END]


def _leases(desk: Desk) -> list[Assignment]:
    """All leases that were given, in order."""
    return [lease for each in of_type(Leases, desk.published) for lease in each.assignments]


def _notes(desk: Desk) -> list[str]:
    assert desk.module.notes is not None
    return desk.module.notes()


def test_answers_in_time_leave_the_deadline_and_say_nothing() -> None:
    desk = Desk("w1", run=REAL_TIME)
    _drive(desk, 0, 60)

    assert len(_in_time(desk)) == 60
    assert all(_in_time(desk))
    assert _notes(desk) == []


def test_the_deadline_follows_answers_that_a_link_makes_late() -> None:
    desk = Desk("w1", "w2", run=REAL_TIME)
    _drive(desk, 200, 100)
    in_time = _in_time(desk)

    assert not any(in_time[:5])
    assert all(in_time[10:])
    assert len(in_time) > 25
    ((wrong, remedy),) = map(wrong_and_remedy, _notes(desk))
    assert wrong.startswith("answers come 200 ms after their tasks: of the last ")
    assert remedy.startswith("shorten the way")


def test_the_lease_follows_them_too_so_that_no_task_is_given_twice() -> None:
    desk = Desk("w1", "w2", run=REAL_TIME)
    _drive(desk, 200, 50)
    given = [lease.attempt for lease in _leases(desk)]

    assert max(given[:20]) == 1
    assert not any(given[100:])


def test_where_the_deadline_may_not_follow_health_says_what_helps() -> None:
    desk = Desk("w1", run=REAL_TIME)
    _drive(desk, 500, 100)
    assert sum(_in_time(desk)[-20:]) < 20

    ((wrong, remedy),) = map(wrong_and_remedy, _notes(desk))
    assert wrong.startswith("answers come 500 ms after their tasks: of the last ")
    told = re.match(r"set workspace.longest_deadline_ms to (\d+), or shorten", remedy)
    assert told is not None

    better = Desk("w1", run=REAL_TIME, longest_deadline_ms=float(told[1]))
    _drive(better, 500, 100)
    assert all(_in_time(better)[-5:])
    assert "set workspace" not in "".join(_notes(better))


def test_without_any_answers_a_cycle_ends_as_early_as_before() -> None:
    desk = Desk("w1", run=REAL_TIME)
    _drive(desk, None, 20)

    assert len(_in_time(desk)) >= 19
    assert not any(_in_time(desk))
