"""A flood is shed, counted and named; a backlog and a fast recording are none."""

from __future__ import annotations

import math
from itertools import count, islice

from msgspec.structs import replace

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.depth import KEPT_S, flow_of
from cogmap.bus.interface import Arrival, Sent
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.runtime.delivery.flood import (
    ASKED_BURST,
    ASKED_HZ,
    ASKED_S,
    CALM_S,
    FASTEST,
    REFUSED_BURST,
    Flood,
)
from cogmap.runtime.module import Module
from cogmap.runtime.notes import wrong_and_remedy
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic
from cogmap.testing import odometry

INCARNATION = 7
NUMBER = 100_000
PERCEPTS_HZ = flow_of(topics.PERCEPTS).rate_hz


class Door:
    """A flood's door, at which messages come at times of its own."""

    def __init__(self) -> None:
        self.flood = Flood(lambda: self.now_s)
        self.now_s = 0.0

    def come(self, number: int, rate_hz: float = math.inf, source: str = "someone") -> int:
        """Let percepts come. Returns how many come in."""
        admitted = 0
        for seq in range(number):
            self.now_s += 1 / rate_hz
            admitted += self.flood.admits(_arrival(seq, source))
        return admitted


def _arrival(seq: int, source: str, refused: str = "", topic: Topic = topics.PERCEPTS) -> Arrival:
    return Arrival(topic, b"", Envelope(source, seq, INCARNATION, 0, 0), 0, refused)


def _backlog(topic: Topic) -> int:
    return int(KEPT_S * flow_of(topic).rate_hz)


def test_the_backlog_of_five_minutes_comes_in_at_once() -> None:
    door = Door()
    number = _backlog(topics.PERCEPTS)

    assert door.come(number) == number
    assert not door.flood.shed
    assert door.flood.notes() == []


def test_a_recording_that_is_played_a_hundred_times_as_fast_comes_in() -> None:
    assert Door().come(NUMBER, FASTEST * PERCEPTS_HZ) == NUMBER


def test_while_a_flood_lasts_nothing_of_it_comes_in_and_soon_after_its_source_is_heard() -> None:
    door = Door()
    number = _backlog(topics.PERCEPTS)
    came = door.come(NUMBER, 40_000)

    assert number <= came < 1.1 * number
    assert door.flood.shed == {topics.PERCEPTS.name: NUMBER - came}
    ((wrong, remedy),) = map(wrong_and_remedy, door.flood.notes())
    assert wrong == f"{NUMBER - came} messages of epam/percepts of someone were shed, as a flood"
    assert remedy == "end someone"

    assert not door.flood.admits(_arrival(NUMBER, "someone"))
    door.now_s += 1.1 * CALM_S
    assert door.flood.admits(_arrival(NUMBER + 1, "someone"))


def test_a_flood_takes_nothing_from_others_nor_from_its_sources_other_topics() -> None:
    door = Door()
    door.come(NUMBER, 40_000, "flood")

    assert door.flood.admits(_arrival(0, "other"))
    assert door.flood.admits(_arrival(0, "flood", topic=topics.SCAN))


def test_what_is_refused_is_read_for_a_while_whatever_source_it_states() -> None:
    flood = Door().flood
    number = 10_000
    came = 0
    for seq in range(number):
        came += flood.admits(_arrival(seq, f"source-{seq}", "it is not on the bus"))

    assert came == REFUSED_BURST
    assert flood.admits(_arrival(0, "source-1"))
    (told,) = flood.notes()
    assert told.startswith(f"{number - came} messages of epam/percepts were shed that would be")


def test_of_many_requests_as_many_are_answered_as_all_modules_make_and_some_of_the_others() -> None:
    door = Door()
    burst = [door.flood.admits_request(topics.SNAPSHOT_REQUEST) for _ in range(300)]
    assert burst == [True] * int(ASKED_BURST) + [False] * (300 - int(ASKED_BURST))

    door.now_s += 2.5 / ASKED_HZ
    later = [door.flood.admits_request(topics.SNAPSHOT_REQUEST) for _ in range(3)]
    assert later == [True, True, False]


def test_requests_whose_answers_take_long_have_half_of_a_modules_time() -> None:
    door = Door()
    answer_s = 0.2
    answering_s = 0.0
    for _ in range(1000):
        if door.flood.admits_request(topics.SNAPSHOT_REQUEST):
            door.now_s += answer_s
            answering_s += answer_s
            door.flood.answered(topics.SNAPSHOT_REQUEST, answer_s)
        door.now_s += 0.01

    at_once_s = ASKED_BURST * ASKED_S
    assert answering_s <= at_once_s + answer_s + door.now_s * ASKED_HZ * ASKED_S
    assert answering_s >= door.now_s * ASKED_HZ * ASKED_S - answer_s


class Flooded:
    """A module in a shell that receives odometry, and one who sends it as `flood`, and keeps none
    of what it has sent.
    """

    def __init__(self) -> None:
        network = MemoryNetwork()
        self.received: list[int] = []
        self.asked: list[tuple[int, int]] = []
        module = Module("receiver").on(topics.ODOMETRY, lambda each: self.received.append(each.seq))
        self.now_s = 0.0
        self.shell = Shell(module, MemoryBus(network))
        self.shell.flood = Flood(lambda: self.now_s)
        self.shell.open()
        self._bus = MemoryBus(network)
        self._bus.serve_past(topics.ODOMETRY, "flood", self._past)
        self._numbers = count()

    def _past(self, topic: Topic, first: int, last: int) -> list[Sent]:
        self.asked.append((first, last))
        return []

    def send(self, number: int) -> None:
        """Send so many messages at once, and let the module receive what comes in."""
        for seq in islice(self._numbers, number):
            message = replace(odometry(seq), source="flood", seq=seq)
            envelope = Envelope("flood", seq, INCARNATION, 0, 0, earlier=0)
            self._bus.publish(topics.ODOMETRY, encode(message), envelope)
        while self.shell.spin_once():
            pass


def test_what_was_shed_counts_as_rejected_and_is_neither_lost_nor_fetched() -> None:
    flooded = Flooded()
    number = _backlog(topics.ODOMETRY)
    flooded.send(2 * number)
    shed = flooded.shell.flood.shed[topics.ODOMETRY.name]
    assert shed > 0
    assert len(flooded.received) == 2 * number - shed

    flooded.now_s += 1.1 * CALM_S
    flooded.send(1)
    assert flooded.received[-1] == 2 * number
    assert flooded.asked == []
    assert not flooded.shell.intake.gaps
