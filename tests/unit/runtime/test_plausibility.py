"""What makes sense but cannot be true, by what was accepted before it."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from cogmap.errors import MessageError
from cogmap.runtime.delivery.plausibility import AGREED_NS, AGREEING, Plausibility
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Competition
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import Reset
from tests.support.health import report

S = 10**9
FAR = 2**60
UNIX_NS = 1_700_000_000 * S


class Process:
    """Receives messages, at a time in seconds, and keeps which it accepted."""

    def __init__(self) -> None:
        self.plausibility = Plausibility()
        self.now_ns = 0

    def accepts(self, message: Message, after_s: float = 0.1) -> bool:
        """Whether it takes `message`, so long after the one before."""
        self.now_ns += round(after_s * S)
        try:
            self.plausibility.check(topics.of(message), message, self.now_ns)
        except MessageError:
            return False
        return True


def clock(stamp_s: float) -> Clock:
    return Clock(stamp_ns=round(stamp_s * S), source="sim")


def competition(cycle: int, stamp_ns: int = 0) -> Competition:
    return Competition(cycle=cycle, stamp_ns=stamp_ns, contenders=[])


def delta(version: int, cycle: int = 1) -> Delta:
    return Delta(version=version, cycle=cycle, phase=Phase.END, operations=[])


@pytest.mark.parametrize(
    ("before", "far"),
    [
        (clock(5), Clock(stamp_ns=FAR)),
        (Clock(stamp_ns=UNIX_NS), Clock(stamp_ns=FAR)),
        (competition(7), competition(FAR)),
        (delta(7), delta(2**50)),
        (delta(7), competition(FAR)),
    ],
)
def test_a_number_far_from_the_one_before_is_refused(before: Message, far: Message) -> None:
    process = Process()
    assert process.accepts(before)

    assert not process.accepts(far)
    assert process.accepts(before)


def test_health_names_what_was_refused_and_by_how_much() -> None:
    process = Process()
    process.accepts(clock(5))
    assert process.plausibility.notes() == []

    process.accepts(clock(100_005))
    (note,) = process.plausibility.notes()
    assert "1 messages" in note
    assert "clock of sim: its stamp lies 100,000 s ahead of" in note


def test_pauses_and_repetitions_within_an_hour_are_accepted() -> None:
    process = Process()
    for stamp_s in (5, 3500, 3500, 10, 3600):
        assert process.accepts(clock(stamp_s))


def test_a_message_that_states_no_time_says_nothing_about_it() -> None:
    process = Process()
    process.accepts(Clock(stamp_ns=UNIX_NS))

    assert process.accepts(Reset())
    assert process.accepts(Clock(stamp_ns=UNIX_NS))


def test_health_is_of_the_walls_time() -> None:
    health = replace(report("motor"), stamp_ns=UNIX_NS)
    process = Process()
    process.accepts(clock(5))

    assert process.accepts(health)
    assert process.accepts(clock(6))


@pytest.mark.parametrize(("stamp_s", "distance"), [(41, "60 s behind"), (161, "60 s ahead of")])
def test_what_lies_far_from_the_messages_before_is_accepted_and_named(
    stamp_s: int, distance: str
) -> None:
    process = Process()
    for before_s in (100, 96, 101):
        assert process.accepts(clock(before_s))
    assert process.plausibility.notes() == []

    assert process.accepts(replace(competition(7), stamp_ns=stamp_s * S, source="stranger"))
    assert process.accepts(clock(101))

    (note,) = process.plausibility.notes()
    what = f"global_workspace/competition of stranger: its stamp lies {distance} all before it"
    assert note == f"1 messages jumped in time, the last: {what}"


def test_a_simulation_that_begins_anew_is_named_for_a_second() -> None:
    process = Process()
    process.accepts(clock(100))

    for number in range(100):
        assert process.accepts(clock(1 + number / 10))

    (note,) = process.plausibility.notes()
    named = int(note.split()[0])
    assert named + 1 >= AGREEING
    assert (named - 1) * 0.1 * S <= AGREED_NS


def test_of_a_refused_message_no_number_counts() -> None:
    process = Process()
    process.accepts(competition(7, 5 * S))

    assert not process.accepts(competition(FAR, 3000 * S))
    assert not process.accepts(clock(4000))


def test_after_a_first_message_that_was_not_true_the_true_ones_are_believed_again() -> None:
    process = Process()
    assert process.accepts(Clock(stamp_ns=FAR))

    believed = [process.accepts(clock(5 + number / 10)) for number in range(20)]
    waited = believed.index(True)
    assert waited + 1 >= AGREEING
    assert waited * 0.1 * S <= AGREED_NS
    assert all(believed[waited:])


def test_a_recording_that_goes_on_a_day_later_is_believed_after_a_second() -> None:
    process = Process()
    process.accepts(clock(5))

    day_s = 86_400
    assert not process.accepts(clock(day_s))
    assert not process.accepts(clock(day_s))
    assert process.accepts(clock(day_s), after_s=3.0)


def test_a_flood_is_never_believed_while_the_true_ones_come() -> None:
    process = Process()
    for number in range(50):
        assert process.accepts(clock(5 + number / 20), after_s=0.001)
        for _ in range(100):
            assert not process.accepts(Clock(stamp_ns=FAR), after_s=0.0005)


def test_two_that_do_not_agree_with_each_other_are_not_believed() -> None:
    process = Process()
    process.accepts(clock(5))

    for _ in range(20):
        assert not process.accepts(Clock(stamp_ns=FAR))
        assert not process.accepts(Clock(stamp_ns=2 * FAR))
