"""What a bus is: the Zenoh bus and the in-memory bus pass the same contract tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from cogmap.bus.codec import Envelope
from cogmap.schemas.topics import Topic

Job = Callable[[], None]


@dataclass(slots=True)
class Arrival:
    """One received message: still bytes, the envelope None if it could not be decoded.

    `refused` says why it does not count, if its source's present incarnation is not its own.
    """

    topic: Topic
    payload: bytes | memoryview
    envelope: Envelope | None
    received_ns: int
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to a query: still bytes, with the envelope of whoever answered, if it sent one."""

    payload: bytes
    envelope: Envelope | None = None


@dataclass(frozen=True, slots=True)
class Sent:
    """A message that was published before: its bytes, and those of its envelope."""

    payload: bytes
    envelope: bytes


# Returns messages of a topic with numbers from the first to the last given, in order: a piece of
# them, or none.
Past = Callable[[Topic, int, int], Sequence[Sent]]


@dataclass(frozen=True, order=True)
class Member:
    """An instance of a module."""

    module: str
    instance: str


@dataclass(frozen=True, order=True)
class Incarnation:
    """One life of a source, in a process of `module`: `number` is when it began, in ns of wall
    time, as its envelopes have it.
    """

    module: str
    source: str
    number: int


class Bus(Protocol):
    """Carries bytes on topics between members.

    Callbacks are called on the bus's threads: they only enqueue, and nothing is published from one.
    """

    def declare(self, topic: Topic) -> None:
        """Prepare to publish on `topic`."""

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        """Send `payload` to every subscriber of `topic`, which has been declared.

        It claims the incarnation that the envelope names, unless that was claimed before.
        """

    def claim(self, incarnation: Incarnation) -> None:
        """Let everybody know that this process publishes as that incarnation of its source: until
        it claims another one of that source, this bus closes, or its process dies.
        """

    def incarnations(self) -> list[Incarnation]:
        """Return those that are claimed now."""

    def members(self) -> list[Member]:
        """Return those that are ready now."""

    def conflicts(self) -> list[str]:
        """Say of each source as which several processes publish which one of them counts."""

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        """Hand every message of `topic` to `deliver`.

        A message of an incarnation that nobody on the bus claims waits for that, in order; if it
        waits in vain, or the source's present incarnation is another one, it comes as `refused`.
        `on_gap` is called with the topic's name and a number if messages are lost. Of a NEVER_DROP
        topic, up to `history` earlier messages of each publisher that is still there come first.
        """

    def serve(
        self,
        request: Topic,
        reply: Topic,
        handler: Callable[[bytes], Answer],
        enqueue: Callable[[Job], None],
    ) -> None:
        """Answer queries for `request` with what `handler` returns, a message of `reply`.

        An exception in `handler` goes back as an error. A bus with threads of its own hands the
        work to `enqueue`, for the member's own thread.
        """

    def query(self, request: Topic, payload: bytes, timeout_s: float) -> Answer:
        """Send a query and wait for its answer. Raises NoAnswerError."""

    def serve_past(self, topic: Topic, source: str, past: Past) -> None:
        """Answer who asks for earlier messages of `topic` that `source` published.

        `past` is called on a thread of the bus.
        """

    def fetch_past(
        self, topic: Topic, source: str, first: int, last: int, timeout_s: float
    ) -> list[Arrival]:
        """Ask `source` for its messages of `topic` with numbers from `first` to `last`.

        Returns a piece of them, in order, none if it has none. Raises NoAnswerError if `source` is
        not there, or does not answer in time.
        """

    def announce(self, member: Member) -> None:
        """Let everybody know that `member` is ready, until this bus closes or its process dies."""

    def watch(self, on_change: Callable[[Member, bool], None]) -> None:
        """Call `on_change` with every member that is or becomes ready (True), or leaves (False)."""

    def close(self) -> None:
        """Leave the bus. What was published is sent first."""
