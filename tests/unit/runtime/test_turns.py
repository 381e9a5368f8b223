"""Nobody waits for the backlog of another source, and each source's messages stay in order."""

from __future__ import annotations

from cogmap.bus.codec import Envelope
from cogmap.bus.interface import Arrival
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.turns import MOST_WAITING, Turns
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic

MANY = 10 * MOST_WAITING


class Queue:
    """An inbox with turns, and what was received from it: source, topic and number."""

    def __init__(self) -> None:
        self.received: list[tuple[str, str, int]] = []
        self._inbox = Inbox()
        self.turns = Turns(self._inbox.put, self._inbox.call, self._receive)

    def put(self, source: str, seq: int, topic: Topic = topics.DELTA, refused: str = "") -> None:
        """Let a message arrive."""
        envelope = Envelope(source, seq, 1, 0, 0)
        self.turns.put(Arrival(topic, b"", envelope, 0, refused))

    def work(self, items: int | None = None) -> None:
        """Receive so many, or all."""
        while items is None or items > 0:
            item = self._inbox.take(0.0)
            if item is None:
                return
            if isinstance(item, Arrival):
                self.turns.taken(item)
                self._receive(item)
            else:
                item()
            items = None if items is None else items - 1

    def _receive(self, arrival: Arrival) -> None:
        assert arrival.envelope is not None
        envelope = arrival.envelope
        self.received.append((envelope.source, arrival.topic.name, envelope.seq))


def test_another_source_waits_for_no_more_than_the_beginning_of_a_backlog() -> None:
    queue = Queue()
    for seq in range(MANY):
        queue.put("long", seq)
    for seq in range(3):
        queue.put("short", seq)
    queue.work()

    places = [place for place, each in enumerate(queue.received) if each[0] == "short"]
    assert places[-1] <= MOST_WAITING + 3
    assert len(queue.received) == MANY + 3
    assert len(queue.turns) == 0


def test_messages_of_one_source_stay_in_order_whatever_comes_meanwhile() -> None:
    queue = Queue()
    for seq in range(MANY):
        queue.put("long", seq, (topics.DELTA, topics.TASK)[seq % 2])
        if seq % 7 == 0:
            queue.put("short", seq)
            queue.work(2)
    queue.work()

    for source in ("long", "short"):
        seqs = [seq for name, _, seq in queue.received if name == source]
        assert seqs == sorted(seqs)
    assert len(queue.received) == MANY + len(range(0, MANY, 7))


def test_few_messages_are_received_in_the_order_in_which_they_came() -> None:
    queue = Queue()
    for seq in range(MOST_WAITING):
        queue.put("one", seq)
        queue.put("other", seq)
    queue.work()

    assert [seq for _, _, seq in queue.received] == [seq // 2 for seq in range(2 * MOST_WAITING)]


def test_what_is_refused_takes_nothing_from_the_source_that_it_states() -> None:
    queue = Queue()
    for seq in range(MANY):
        queue.put("true", seq, refused="it is not on the bus")
    queue.put("true", 0)
    queue.work(MOST_WAITING + 2)

    assert len(queue.turns) > 0
    assert len([each for each in queue.received if each[2] == 0]) == 2
