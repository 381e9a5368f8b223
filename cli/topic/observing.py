"""A look at a running system from outside: what arrives on a topic, and who is there."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue

import zenoh

from cogmap.bus.codec import Envelope
from cogmap.bus.discovery import System, discover
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.session import open_client
from cogmap.bus.zenoh_bus import ZenohBus
from schemas.topics import Topic

TICK_S = 0.1
CLI = "cli"


class Sight:
    """What is worth knowing of an arrival whose payload nobody reads."""

    __slots__ = ("envelope", "received_ns", "size_bytes")

    def __init__(self, arrival: Arrival) -> None:
        self.size_bytes = len(arrival.payload)
        self.envelope: Envelope | None = arrival.envelope
        self.received_ns = arrival.received_ns


class Sights:
    """Every arrival on a topic, in order."""

    def __init__(self, bus: ZenohBus, topic: Topic) -> None:
        self._queue: SimpleQueue[Sight] = SimpleQueue()
        bus.subscribe(
            topic, lambda arrival: self._queue.put(Sight(arrival)), lambda name, number: None
        )

    def take(self, timeout_s: float) -> Sight | None:
        """The next one; None where there is none within `timeout_s`."""
        try:
            return self._queue.get(timeout=timeout_s)
        except Empty:
            return None


@contextmanager
def observing(connect: str, agent: str, what: str) -> Iterator[ZenohBus]:
    """A bus that others see as `cli what`; it is left in the end, also where nobody reads the
    output any more.
    """
    bus = ZenohBus(connect, agent)
    try:
        bus.identify(Member(CLI, f"{CLI} {what}"))
        yield bus
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    finally:
        bus.close()


def look(connect: str, agent: str) -> System:
    """What the processes of `agent` do at this moment. Raises NoRouterError."""
    session: zenoh.Session = open_client(connect)
    try:
        return discover(session, agent)
    finally:
        session.close()  # type: ignore[no-untyped-call]
