"""Messages that make sense but are not true: refused, or the workspace is soon itself again."""

from __future__ import annotations

import msgspec
import pytest

from cogmap.errors import MessageError
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer, Task
from cogmap.schemas.cognition import Broadcast, Coalition, Competition, Trigger
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import SELF_ID, Goal, Self, goal_id
from cogmap.schemas.process import Presence
from cogmap.schemas.sensing import Energy
from cogmap.services.workspace.config import GivenGoal
from cogmap.services.workspace.offers import MAX_GOALS, MAX_OF_OTHERS, MAX_OPERATIONS
from cogmap.testing import percepts, self_motion, stamp_ns
from tests.support.world.scenes import Desk, answer, thing

LATER = 5000
"""Frames, a quarter of an hour ahead: what a process lets through."""
AWAITING = Run(lockstep=True, participants={"motor": 1})


def _began(desk: Desk, frame: int) -> bool:
    """Whether the newest cycle is that of a view."""
    return desk.deltas[-1].stamp_ns == stamp_ns(frame)


@pytest.mark.parametrize(
    "untrue",
    [
        Competition(cycle=4, contenders=[]),
        Broadcast(
            cycle=4,
            trigger=Trigger.AGGREGATE,
            coalition=Coalition(codelet="novelty", activation=1.0, nodes=[]),
        ),
        Offer(cycle=4, operations=[], source="motor"),
    ],
)
def test_what_is_of_a_cycle_that_has_not_begun_is_refused(untrue: Message) -> None:
    desk = Desk("w1")
    desk.drive(range(3))

    with pytest.raises(MessageError, match="is of cycle 4, and the newest is 3"):
        desk.feed(untrue)
    desk.drive(range(3, 4))
    assert _began(desk, 3)


def test_after_a_view_of_a_later_time_the_second_true_one_begins_a_cycle() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    desk.drive(range(LATER, LATER + 1))
    assert _began(desk, LATER)

    desk.drive(range(3, 4))
    assert _began(desk, LATER)
    desk.drive(range(4, 6))
    assert _began(desk, 5)
    assert desk.agent.stamp_ns == stamp_ns(5)
    assert "older" in "".join(desk.module.notes() if desk.module.notes else [])


def test_what_was_sensed_at_a_later_time_takes_no_place_for_good() -> None:
    desk = Desk("w1", run=Run(lockstep=True, energy=True))
    for number in range(50):
        stamp = stamp_ns(LATER + number)
        desk.feed(Energy(stamp_ns=stamp, frame=number, level=0.0))
        desk.feed(self_motion(LATER + number))

    for frame in range(2):
        desk.feed(Energy(stamp_ns=stamp_ns(frame), frame=frame, level=1.0))
        desk.drive(range(frame, frame + 1))
        assert _began(desk, frame)


def test_an_answer_from_whom_the_task_was_not_given_to_is_refused() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    holder = desk.lease(asked).worker
    (other,) = {"w1", "w2"} - {holder}

    for stranger in (other, "stranger"):
        refusal = f"of '{stranger}' to 1/localization, which was given to {holder}"
        with pytest.raises(MessageError, match=refusal):
            desk.feed(msgspec.structs.replace(answer(asked), source=stranger))

    desk.feed(answer(asked))
    assert desk.take()


def test_in_lockstep_a_repeated_view_has_the_tasks_given_to_other_workers() -> None:
    desk = Desk("w1", "w2")
    desk.see(0)
    (asked,) = desk.take()
    first = desk.lease(asked)

    desk.see(0)
    (again,) = desk.take()
    second = desk.lease(again)
    assert again.task_id == asked.task_id
    assert second.worker != first.worker
    assert second.attempt == first.attempt


def test_in_lockstep_a_repeated_view_that_moved_nothing_begins_a_cycle_again() -> None:
    desk = Desk("w1")
    desk.drive(range(2))
    desk.see(2)
    _answer_with_nothing(desk)
    cycle = desk.deltas[-1].cycle
    assert desk.agent.stamp_ns == stamp_ns(1)

    desk.drive(range(2, 3))
    assert desk.deltas[-1].cycle == cycle + 1
    assert desk.agent.stamp_ns == stamp_ns(2)


def _answer_with_nothing(desk: Desk) -> None:
    """Let every task of the cycle be answered by nothing."""
    asked: list[Task] = desk.take()
    while asked:
        for task in asked:
            desk.feed(answer(task))
        asked = desk.take()
    assert desk.deltas[-1].phase is Phase.END


def test_in_lockstep_a_repeated_view_waits_for_no_offer_of_a_module_that_is_there() -> None:
    desk = Desk("w1", run=AWAITING)
    present = Presence(module="motor", instance="motor", alive=True, observer="workspace")
    desk.drive(range(1))
    desk.see(1)
    desk.see(1)
    assert _began(desk, 0)

    desk.feed(present)
    desk.see(1)
    assert _began(desk, 1)


def test_a_lease_ends_in_time_after_a_clock_that_ran_far_ahead() -> None:
    desk = Desk("w1", "w2", run=REAL_TIME, lease_ms=100.0, deadline_ms=10_000_000.0)
    desk.clock(stamp_ns(LATER))
    desk.see(0)
    (asked,) = desk.take()
    holder = desk.lease(asked).worker

    desk.clock(stamp_ns(1))
    desk.clock(stamp_ns(1) + 101_000_000)
    assert desk.lease(asked).worker != holder


def test_more_than_a_source_may_offer_for_a_cycle_is_refused_with_a_sentence() -> None:
    desk = Desk("w1")
    most = _things(MAX_OPERATIONS)
    desk.feed(Offer(cycle=0, operations=most, source="goal"))

    with pytest.raises(MessageError, match=f"at most {MAX_OPERATIONS} are taken"):
        desk.feed(Offer(cycle=0, operations=[thing("more")], source="goal"))
    desk.see(0)
    assert "thing-0" in desk.graph.nodes
    assert "more" not in desk.graph.nodes

    desk.feed(Offer(cycle=1, operations=[thing("later")], source="goal"))


def test_many_sources_share_what_they_may_offer_for_a_cycle() -> None:
    desk = Desk("w1")
    for number in range(MAX_OF_OTHERS):
        desk.feed(Offer(cycle=0, operations=[], source=f"source-{number}"))

    with pytest.raises(MessageError, match="all others"):
        desk.feed(Offer(cycle=0, operations=[], source="one-more"))
    desk.feed(Offer(cycle=0, operations=[thing("recalled")], source="memory"))
    desk.see(0)
    assert "recalled" in desk.graph.nodes


def test_what_a_module_offers_too_much_is_left_out_and_counted() -> None:
    desk = Desk("w1", run=AWAITING)
    desk.drive(range(1))
    desk.feed(Offer(cycle=1, operations=_things(MAX_OPERATIONS + 1), source="motor"))
    desk.see(1)

    rejecting = [delta for delta in desk.deltas if delta.rejected]
    assert [delta.cycle for delta in rejecting] == [2]
    assert "thing-0" not in desk.graph.nodes


def _things(number: int) -> list[Message]:
    return [thing(f"thing-{each}") for each in range(number)]


def test_the_agent_takes_so_many_goals_and_no_more_until_some_are_withdrawn() -> None:
    desk = Desk("w1")
    goals = [Goal(id=goal_id(f"g{each:03}"), base_level=1.0, x_m=9.0) for each in range(200)]
    desk.feed(Offer(cycle=0, operations=[*goals], source="goal"))
    desk.drive(range(1))

    kept = list(desk.graph.of_kind(Goal))
    assert len(kept) == MAX_GOALS
    assert sum(delta.rejected for delta in desk.deltas) == len(goals) - MAX_GOALS


def test_goals_that_the_agent_has_from_its_start_leave_room_for_those_of_a_person() -> None:
    given = [GivenGoal(name=f"corner {number}", x_m=9.0) for number in range(2 * MAX_GOALS)]
    desk = Desk("w1", goals=given)
    desk.drive(range(1))
    desk.feed(Offer(cycle=1, operations=[Goal(id=goal_id("home"), base_level=1.0)], source="goal"))
    desk.drive(range(1, 2))

    assert desk.graph.get(Goal, goal_id("home")) is not None


def test_the_self_node_of_a_later_time_is_that_of_the_true_view_in_the_end() -> None:
    desk = Desk("w1")
    desk.drive(range(2))
    desk.feed(self_motion(LATER))
    desk.feed(percepts(LATER))
    desk.work()
    desk.drive(range(2, 5))

    agent = desk.graph.get(Self, SELF_ID)
    assert agent is not None
    assert agent.stamp_ns == stamp_ns(4)


def test_self_motion_of_an_earlier_time_takes_the_place_of_none() -> None:
    desk = Desk("w1")
    desk.drive(range(10))

    desk.feed(self_motion(10))
    desk.feed(self_motion(2))
    desk.feed(percepts(10))

    assert _began(desk, 10)


def test_self_motion_of_a_later_time_is_forgotten_once_two_true_ones_have_come() -> None:
    desk = Desk("w1")
    desk.drive(range(3))
    desk.feed(self_motion(LATER))

    desk.drive(range(3, 5))
    desk.feed(percepts(5))

    assert not desk.take()
    desk.feed(self_motion(5))
    assert desk.take()
