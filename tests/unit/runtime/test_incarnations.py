"""Which incarnation of a source counts, and what happens to the messages of the others."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest

from cogmap.bus.codec import Envelope
from cogmap.bus.incarnations import (
    HOLD_S,
    MAX_DEPARTED,
    MAX_HELD,
    Gate,
    incarnation_key,
    read_incarnation,
    when,
)
from cogmap.bus.interface import Arrival, Incarnation
from cogmap.schemas import topics

FIRST, SECOND, THIRD = 1_000_000_000, 2_000_000_000, 3_000_000_000


class Door:
    """A gate, and what has passed it: the numbers, and those refused."""

    def __init__(self) -> None:
        self.gate = Gate(lambda: self.now_s)
        self.now_s = 0.0
        self.passed: list[int] = []
        self.reasons: list[str] = []
        self._number = 0

    def close(self) -> None:
        self.gate.close()

    def present(self, number: int, alive: bool = True, source: str = "workspace") -> None:
        self.gate.note(Incarnation("workspace", source, number), alive)

    def put(self, incarnation: int, source: str = "workspace") -> int:
        """A message of that incarnation; returns its number."""
        self._number += 1
        envelope = Envelope(source, self._number, incarnation, 0, 0)
        self.gate.put(Arrival(topics.DELTA, b"", envelope, 0), self._deliver)
        return self._number

    def expire(self) -> None:
        """Let the time pass in which a token may come."""
        self.now_s += HOLD_S
        self.gate.expire()

    def _deliver(self, arrival: Arrival) -> None:
        assert arrival.envelope is not None
        if arrival.refused:
            self.reasons.append(arrival.refused)
        else:
            self.passed.append(arrival.envelope.seq)


@pytest.fixture
def door() -> Iterator[Door]:
    opened = Door()
    yield opened
    opened.close()


def test_a_message_of_whom_the_bus_has_is_delivered_at_once(door: Door) -> None:
    door.present(FIRST)

    number = door.put(FIRST)

    assert door.passed == [number]


def test_messages_that_come_before_their_token_are_delivered_with_it_in_order(door: Door) -> None:
    numbers = [door.put(FIRST) for _ in range(3)]
    assert door.passed == []

    door.present(FIRST)

    assert door.passed == numbers
    door.expire()
    assert door.reasons == []


def test_a_message_of_whom_no_token_states_is_refused_in_words(door: Door) -> None:
    door.present(FIRST)
    door.put(SECOND)

    door.expire()

    assert door.passed == []
    assert door.reasons == [
        "it says it is of 'workspace', started at 1970-01-01T00:00:02.000+00:00, "
        "which is not on the bus"
    ]


def test_a_liar_with_a_newer_incarnation_silences_nobody(door: Door) -> None:
    door.present(FIRST)
    before = door.put(FIRST)

    door.put(2**61)
    after = door.put(FIRST)

    assert door.passed == [before, after]


def test_a_source_that_leaves_and_comes_with_another_start_has_a_successor(door: Door) -> None:
    door.present(FIRST)
    first = door.put(FIRST)
    door.present(FIRST, alive=False)
    door.present(SECOND)

    second = door.put(SECOND)
    on_its_way = door.put(FIRST)
    assert door.passed == [first, second, on_its_way]

    door.now_s += HOLD_S + 0.1
    door.put(FIRST)
    door.expire()
    assert door.passed == [first, second, on_its_way]
    assert len(door.reasons) == 1


def test_a_successor_may_come_before_its_predecessor_is_seen_to_leave(door: Door) -> None:
    door.present(FIRST)
    door.put(FIRST)
    door.present(SECOND)
    early = door.put(SECOND)

    door.present(FIRST, alive=False)

    assert door.passed[1:] == [early]


def test_a_message_that_its_own_successor_overtook_is_on_its_way_too(door: Door) -> None:
    door.present(FIRST)
    door.present(FIRST, alive=False)
    door.present(SECOND)

    numbers = [door.put(FIRST), door.put(SECOND)]

    assert door.passed == numbers


def test_a_clock_that_went_back_makes_a_successor_too(door: Door) -> None:
    door.present(SECOND)
    door.put(SECOND)
    door.present(SECOND, alive=False)
    door.present(FIRST)

    number = door.put(FIRST)

    assert door.passed[1:] == [number]


def test_of_two_at_once_the_first_counts_and_the_second_is_said(
    door: Door, caplog: pytest.LogCaptureFixture
) -> None:
    door.present(FIRST)
    before = door.put(FIRST)
    with caplog.at_level(logging.WARNING, "cogmap"):
        door.present(SECOND)

    door.put(SECOND)
    after = door.put(FIRST)
    door.expire()

    assert door.passed == [before, after]
    assert door.reasons == [
        "it says it is of 'workspace', started at 1970-01-01T00:00:02.000+00:00, "
        "while the one started at 1970-01-01T00:00:01.000+00:00 is on the bus"
    ]
    (conflict,) = door.gate.conflicts()
    assert conflict.startswith("2 processes publish as workspace: the one started at 1970-01-01")
    assert caplog.messages == [conflict]

    door.present(SECOND, alive=False)
    assert door.gate.conflicts() == []


def test_who_joins_while_there_are_two_believes_the_older(door: Door) -> None:
    door.present(SECOND)
    door.present(FIRST)

    number = door.put(FIRST)

    assert door.passed == [number]


def test_a_source_that_comes_back_after_its_router_is_the_same(door: Door) -> None:
    door.present(FIRST)
    door.put(FIRST)
    door.present(FIRST, alive=False)
    on_its_way = door.put(FIRST)
    door.present(FIRST)
    back = door.put(FIRST)

    assert door.passed[1:] == [on_its_way, back]


def test_a_third_takes_the_place_only_of_whom_has_left(door: Door) -> None:
    for number in (FIRST, SECOND, THIRD):
        door.present(number)
    door.put(FIRST)

    door.present(FIRST, alive=False)
    door.put(THIRD)
    number = door.put(SECOND)

    assert door.passed[1:] == [number]


def test_what_waits_is_bounded_in_number(door: Door) -> None:
    for _ in range(MAX_HELD + 1):
        door.put(FIRST)
    assert len(door.reasons) == 1


def test_what_waits_is_bounded_in_bytes(door: Door) -> None:
    large = Arrival(topics.VIEW, bytes(2**26), Envelope("sensory", 0, 1, 0, 0), 0)
    refused: list[str] = []

    for _ in range(2):
        door.gate.put(large, lambda arrival: refused.append(arrival.refused))

    assert len(refused) == 1


def test_sources_that_have_left_take_no_more_room(door: Door) -> None:
    for number in range(MAX_DEPARTED + 1):
        door.present(FIRST, source=f"goal-{number}")
        door.present(FIRST, alive=False, source=f"goal-{number}")

    door.put(FIRST, source="goal-0")
    newest = door.put(FIRST, source=f"goal-{MAX_DEPARTED}")

    assert door.passed == [newest]


def test_a_message_without_an_envelope_passes_for_its_receiver_to_count(door: Door) -> None:
    found: list[Arrival] = []
    arrival = Arrival(topics.DELTA, b"", None, 0)

    door.gate.put(arrival, found.append)

    assert found == [arrival]


@pytest.mark.parametrize("source", ["workspace", "memory.store", "", "a/b", "Zürich 1", "*", "%"])
def test_every_source_can_be_in_a_key(source: str) -> None:
    incarnation = Incarnation("workspace", source, -7)

    key = incarnation_key("agent", incarnation)

    assert key.count("/") == 5
    assert read_incarnation(key) == incarnation


def test_a_token_without_a_number_states_nothing() -> None:
    assert read_incarnation("cogmap/agent/@incarnation/workspace/workspace/now") is None


def test_a_start_that_is_no_time_is_named_by_its_number() -> None:
    assert when(2**90) == str(2**90)
    assert when(1_700_000_000_500_000_000) == "2023-11-14T22:13:20.500+00:00"
