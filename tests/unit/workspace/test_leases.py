"""Workers that go, leases that end, deadlines, and answers that come late."""

from __future__ import annotations

from collections import Counter

import msgspec
import pytest

from cogmap.errors import MessageError
from cogmap.runtime.run import REAL_TIME
from cogmap.schemas.codelets import Task
from cogmap.schemas.nodes import NEVER_NS, Self
from cogmap.schemas.process import Presence
from cogmap.services.codelets.sub_maps.coarse_places import EVERY_CYCLES
from cogmap.services.workspace.tasks.dispatch import MAX_ATTEMPTS
from cogmap.testing import (
    PERIOD_NS,
    agent,
    landmark,
    of_type,
    percept,
    percepts,
    self_motion,
    stamp_ns,
)
from tests.support.world.scenes import Desk, answer

MS = 1_000_000


def _moved_self(frame: int, x_m: float = 1.0) -> Self:
    return agent(x_m=x_m, stamp_ns=stamp_ns(frame))


def _held(desk: Desk, asked: Task) -> tuple[str, int]:
    """Who holds a task, and how often it was lost."""
    lease = desk.lease(asked)
    return lease.worker, lease.attempt


def _real_time(*workers: str) -> tuple[Desk, Task]:
    """A workspace in real time that has just asked for a localization, and what it asked."""
    desk = Desk(*workers, run=REAL_TIME, lease_ms=100.0, deadline_ms=180.0)
    desk.clock(stamp_ns(0))
    desk.see(0)
    (asked,) = desk.take()
    return desk, asked


def _committed(desk: Desk, asked: Task) -> int:
    return sum(asked.task_id in delta.tasks for delta in desk.deltas)


def test_tasks_wait_where_there_is_no_worker_and_go_out_when_one_comes() -> None:
    desk = Desk()
    desk.see(0)
    assert desk.tasks == []

    desk.presence("w1")
    (asked,) = desk.take()
    assert _held(desk, asked) == ("w1", 0)


def _holder(desk: Desk, asked: Task) -> str:
    worker, _ = _held(desk, asked)
    return worker


def _after(frame: int, ms: int) -> int:
    """A time in milliseconds after a view was sensed, in nanoseconds."""
    return stamp_ns(frame) + ms * MS


def test_tasks_of_one_phase_are_spread_over_the_workers() -> None:
    desk = Desk("w1", "w2", "w3")
    desk.see(0, percept("a"), percept("b"), percept("c"), percept("d"), percept("e"))
    (localization,) = desk.take()
    desk.feed(answer(localization))
    holders = Counter(_holder(desk, asked) for asked in desk.take())

    assert holders == {"w1": 3, "w2": 2, "w3": 2}


def test_a_lost_workers_task_is_given_to_another_and_committed_once() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    first = _holder(desk, asked)

    desk.presence(first, alive=False)
    (again,) = desk.take()
    second, attempt = _held(desk, again)
    assert again.task_id == asked.task_id
    assert attempt == 1
    assert {first, second} == {"w1", "w2"}

    desk.feed(answer(again, [_moved_self(0)]))
    desk.feed(answer(asked, [_moved_self(0, 7.0)]))
    assert _committed(desk, asked) == 1
    assert desk.agent.x_m == 1.0


def test_an_answer_of_whom_a_task_was_not_given_to_is_refused_and_changes_nothing() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    forged = msgspec.structs.replace(answer(asked, [_moved_self(0, 7.0)]), source="stranger")

    with pytest.raises(MessageError, match="an answer of 'stranger' to 1/localization, which was"):
        desk.feed(forged)
    desk.feed(answer(asked, [_moved_self(0)]))

    assert desk.agent.x_m == 1.0


def test_a_late_answer_of_a_stranger_is_refused_too() -> None:
    desk, asked = _missed_deadline()
    forged = msgspec.structs.replace(answer(asked, [_moved_self(0, 7.0)]), source="stranger")

    with pytest.raises(MessageError, match="'stranger'"):
        desk.feed(forged)

    assert desk.feed(answer(asked, [_moved_self(0)]))


def test_a_worker_that_goes_without_a_task_changes_nothing() -> None:
    desk = Desk("w1", "w2", "w3")
    desk.see(0)
    (asked,) = desk.take()
    idle, _ = {"w1", "w2", "w3"} - {_holder(desk, asked)}

    assert desk.presence(idle, alive=False) == []


def test_presence_of_other_modules_is_nothing_to_the_dispatch() -> None:
    desk = Desk()
    desk.see(0)
    other = Presence(module="epam", instance="epam", alive=True, observer="workspace")

    assert desk.feed(other) == []
    assert desk.tasks == []


def test_with_its_only_worker_gone_a_task_waits_for_the_next_one() -> None:
    desk = Desk("w1")
    desk.see(0)
    desk.take()
    published = desk.presence("w1", alive=False)
    assert of_type(Task, published) == []

    desk.presence("w9")
    (asked,) = desk.tasks
    assert _held(desk, asked) == ("w9", 1)


@pytest.mark.parametrize("workers", [("w1", "w2"), ("w2", "w1"), ("a", "b", "c")])
def test_a_task_whose_lease_has_ended_is_done_by_another_and_committed_once(
    workers: tuple[str, ...],
) -> None:
    desk, asked = _real_time(*workers)
    first = _holder(desk, asked)
    assert desk.clock(_after(0, 100)) == []

    desk.clock(_after(0, 101))
    (again,) = desk.take()
    second, attempt = _held(desk, again)
    assert again.task_id == asked.task_id
    assert attempt == 1
    assert second != first

    desk.feed(answer(asked, [_moved_self(0)]))
    desk.feed(answer(again, [_moved_self(0, 7.0)]))
    assert _committed(desk, asked) == 1


def test_the_only_worker_keeps_its_task_past_the_lease_until_another_joins() -> None:
    desk, asked = _real_time("w1")
    assert desk.clock(_after(0, 101)) == []

    desk.presence("w2")
    desk.clock(_after(0, 102))
    (again,) = desk.take()
    assert again.task_id == asked.task_id
    assert _held(desk, asked) == ("w2", 1)


def test_a_task_that_no_worker_holds_is_given_to_the_first_that_joins() -> None:
    desk = Desk(run=REAL_TIME, deadline_ms=10_000.0)
    desk.see(0)
    desk.clock(_after(0, 5_000))
    desk.presence("w1")

    (asked,) = desk.take()
    assert _held(desk, asked) == ("w1", 0)


def test_a_task_lost_at_every_attempt_is_given_up_and_the_cycle_continues() -> None:
    desk = Desk("w1", "w2", run=REAL_TIME, lease_ms=10.0, deadline_ms=10_000.0)
    desk.clock(stamp_ns(0))
    desk.see(0)
    for number, ms in enumerate((11, 22, 33, 44, 55)):
        (asked,) = desk.take()
        _, attempt = _held(desk, asked)
        assert asked.codelet == "localization"
        assert attempt == number
        desk.clock(_after(0, ms))

    road, _ = desk.take()
    _, attempt = _held(desk, road)
    assert road.codelet == "road_place"
    assert attempt == 0


def test_in_lockstep_a_task_that_kills_every_worker_is_given_up_and_named() -> None:
    desk = Desk()
    desk.see(0)
    for number in range(MAX_ATTEMPTS):
        assert not any(delta.phase == "end" for delta in desk.deltas)
        desk.presence(f"w{number}")
        desk.presence(f"w{number}", alive=False)

    desk.presence("steady")
    desk.work()

    (rejecting,) = [delta for delta in desk.deltas if delta.rejected]
    assert desk.deltas[-1].phase == "end"
    assert rejecting.reasons == ["task 1/localization was given to 5 workers and lost each time"]


def test_in_lockstep_neither_lease_nor_deadline_ends() -> None:
    desk = Desk("w1")
    desk.see(0)

    assert desk.clock(stamp_ns(1000)) == []


def test_a_cycle_commits_the_answers_at_its_deadline_and_the_next_begins() -> None:
    desk, asked = _real_time("w1", "w2")
    desk.feed(answer(asked, [_moved_self(0)]))
    road, *_ = desk.take()
    desk.clock(_after(0, 180))
    assert desk.deltas[-1].phase == "localization"

    desk.feed(self_motion(1))
    desk.feed(percepts(1))
    desk.clock(_after(0, 181))
    phases = [delta.phase for delta in desk.deltas]
    assert phases == ["percepts", "localization", "end", "percepts"]
    assert _committed(desk, road) == 0


def test_a_clock_that_once_ran_far_ahead_spoils_no_later_cycle() -> None:
    desk, _ = _real_time("w1", "w2")
    desk.clock(stamp_ns(1000))
    assert desk.deltas[-1].phase == "end"

    desk.clock(stamp_ns(1))
    desk.see(1)
    desk.clock(_after(1, 50))
    assert desk.deltas[-1].phase == "percepts"


def test_a_part_of_the_answers_is_committed_at_the_deadline() -> None:
    desk = Desk("w1", "w2", run=REAL_TIME)
    desk.see(0, percept("a"), percept("b"))
    (localization,) = desk.take()
    desk.feed(answer(localization, [_moved_self(0)]))
    first, second, *_ = desk.take()
    desk.feed(answer(second, [landmark("b")]))
    desk.clock(_after(0, 500))

    (objects,) = [delta for delta in desk.deltas if delta.phase == "objects"]
    assert objects.tasks == [second.task_id]
    assert _committed(desk, first) == 0


def _missed_deadline() -> tuple[Desk, Task]:
    """A cycle that ended without its localization, and the task of that."""
    desk, asked = _real_time("w1", "w2")
    desk.clock(_after(0, 181))
    return desk, asked


def test_background_work_is_given_out_after_what_the_broadcast_waits_for() -> None:
    desk = Desk("w1")
    desk.drive(range(EVERY_CYCLES))

    published = of_type(Task, desk.published)
    background = [task.codelet for task in published].index("coarse_places")
    before = published[background - 1]
    assert (before.codelet, before.cycle) == ("whereabouts", published[background].cycle)


def test_background_work_begins_in_a_cycle_that_ends_at_its_deadline_too() -> None:
    desk = Desk("w1", run=REAL_TIME, deadline_ms=180.0)
    last = EVERY_CYCLES - 1
    desk.drive(range(last))

    desk.see(last)
    assert "coarse_places" not in {task.codelet for task in desk.take()}
    desk.clock(_after(last, 181))
    assert "coarse_places" in {task.codelet for task in desk.take()}


def test_a_late_answer_is_committed_in_the_next_cycle_if_it_still_applies() -> None:
    desk, asked = _missed_deadline()
    desk.see(1)
    desk.feed(answer(asked, [_moved_self(0)]))
    late = desk.deltas[-1]

    assert late.phase == "late"
    assert late.tasks == [asked.task_id]
    assert late.cycle == 2
    assert late.rejected == 0
    assert desk.agent.stamp_ns == stamp_ns(0)


def test_a_late_answer_is_committed_between_two_cycles_too() -> None:
    desk, asked = _missed_deadline()
    desk.feed(answer(asked, [_moved_self(0)]))

    assert desk.deltas[-1].tasks == [asked.task_id]


def test_a_late_answer_about_a_changed_node_is_dropped_and_counted() -> None:
    desk, asked = _missed_deadline()
    desk.see(1)
    (newer,) = desk.take()
    desk.feed(answer(newer, [_moved_self(1, 3.0)]))

    before = len(desk.deltas)
    assert desk.feed(answer(asked, [_moved_self(0)])) == []
    assert _committed(desk, asked) == 0

    desk.clock(_after(1, 181))
    (end,) = desk.deltas[before:]
    assert end.rejected == 1
    assert desk.agent.x_m == 3.0


def test_a_late_answer_is_taken_once() -> None:
    desk, asked = _missed_deadline()
    late = answer(asked, [_moved_self(0)])

    assert desk.feed(late)
    assert desk.feed(late) == []


def test_unused_motion_is_given_to_the_next_cycles_localization() -> None:
    desk, _ = _missed_deadline()
    desk.see(1)
    (asked,) = desk.take()

    assert asked.motions is not None
    assert asked.motions.shape == (2, 5)
    assert asked.since_ns == NEVER_NS, "no answer has moved the agent"


def test_workers_that_never_answer_leave_the_deltas_without_a_gap() -> None:
    desk = Desk("w1", run=REAL_TIME)
    for frame in range(5):
        desk.see(frame, percept("a"))
        desk.clock(stamp_ns(frame) + PERIOD_NS)

    versions = [delta.version for delta in desk.deltas]

    assert versions == list(range(1, 11))
    assert not any(delta.tasks for delta in desk.deltas)


def _slow_worker() -> tuple[Desk, str]:
    """A workspace two of whose three workers have answered, and the one that let its lease end."""
    desk, asked = _real_time("w1", "w2", "w3")
    slow = _holder(desk, asked)
    desk.clock(_after(0, 101))
    desk.feed(answer(asked, [_moved_self(0)]))
    desk.take()
    return desk, slow


def _holders(desk: Desk, frame: int) -> set[str]:
    """Who gets the tasks of a view, each answered at once."""
    desk.clock(stamp_ns(frame))
    desk.see(frame, percept("a"), percept("b"), percept("c"))
    found = set()
    while asked := desk.take():
        found |= {_holder(desk, each) for each in asked}
        for each in asked:
            moved = [_moved_self(frame)] if each.codelet == "localization" else []
            desk.feed(answer(each, moved))
    return found


def test_a_worker_that_let_a_lease_end_gets_no_tasks_for_a_while_and_is_named() -> None:
    desk, slow = _slow_worker()
    desk.clock(_after(0, 181))

    assert slow not in _holders(desk, 1)
    assert desk.module.notes is not None
    (told,) = desk.module.notes()
    assert told.startswith(
        f"{slow} kept 1 tasks for longer than their leases, and gets others last"
    )

    assert slow in _holders(desk, 30)
    desk.clock(stamp_ns(100))
    assert desk.module.notes() == []
