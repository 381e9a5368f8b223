"""What a bus is: the Zenoh bus and the in-memory bus both are one, and pass the same contract
tests.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from cogmap.bus.codec import Envelope
from schemas.topics import Topic


@dataclass(slots=True)
class Arrival:
    """One message as it came: still bytes, the envelope decoded where it could be."""

    topic: Topic
    payload: bytes | memoryview
    envelope: Envelope | None
    received_ns: int


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to a query: still bytes, with the envelope of whoever answered, if it sent one."""

    payload: bytes
    envelope: Envelope | None = None


Job = Callable[[], None]
CACHED_MESSAGES = 1024


@dataclass(frozen=True, order=True)
class Member:
    """An instance of a module."""

    module: str
    instance: str


class Bus(Protocol):
    """Carries bytes on topics between members. Callbacks only enqueue; nothing is published from
    one.
    """

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        """Send `payload` to every subscriber of `topic`. Declare the topic first."""

    def declare(self, topic: Topic) -> None:
        """Prepare to publish on `topic`."""

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        """Hand every message of `topic` to `deliver`; `on_gap` is told (topic name, how many) where
        some are lost.

        Of a NEVER_DROP topic, up to `history` messages that each publisher still there said before
        come first.
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

    def announce(self, member: Member) -> None:
        """Tell everybody that `member` is ready; it holds until this bus closes or dies."""

    def watch(self, on_change: Callable[[Member, bool], None]) -> None:
        """Tell of every member that is there, comes or goes."""

    def close(self) -> None:
        """Leave. What was published is sent first."""
