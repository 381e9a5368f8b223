"""An observer of a running system: what arrives on a topic, and which processes there are."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from queue import Empty, Queue

import zenoh

from cogmap.bus.access.subjects import READS
from cogmap.bus.codec import Envelope
from cogmap.bus.discovery import System, discover
from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.bus.session import CONNECT_TIMEOUT_S, open_client
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoRouterError
from cogmap.runtime import environment
from cogmap.schemas.topics import Topic

TICK_S = 0.1
CLI = "cli"


class Reception:
    """Topic, size, envelope and time of one arrival, without its payload."""

    __slots__ = ("envelope", "received_ns", "size_bytes", "topic")

    def __init__(self, arrival: Arrival) -> None:
        self.topic = arrival.topic
        self.size_bytes = len(arrival.payload)
        self.envelope: Envelope | None = arrival.envelope
        self.received_ns = arrival.received_ns


class Receptions:
    """Every arrival on some topics for which `counts` is true, in order."""

    def __init__(
        self,
        bus: Bus,
        watched: Iterable[Topic],
        counts: Callable[[Arrival], bool] = lambda arrival: True,
    ) -> None:
        self._queue: Queue[Arrival] = Queue()
        self._counts = counts
        for topic in watched:
            bus.subscribe(topic, self._queue.put, lambda name, number: None)

    def take(self, timeout_s: float) -> Reception | None:
        """Take the next one; None if there is none within `timeout_s`, or the next one does not
        count.
        """
        try:
            arrival = self._queue.get(timeout=timeout_s)
        except Empty:
            return None
        return Reception(arrival) if self._counts(arrival) else None


class RouterWatch:
    """Whether the router that `session` found at `endpoint` is still there."""

    def __init__(
        self, session: zenoh.Session, endpoint: str, timeout_s: float = CONNECT_TIMEOUT_S
    ) -> None:
        self._session = session
        self._endpoint = endpoint
        self._timeout_s = timeout_s
        self._missing_since_s: float | None = None

    def check(self) -> None:
        """Raise NoRouterError if the checks of the last `timeout_s` found no router."""
        if self._session.info.routers_zid():
            self._missing_since_s = None
            return

        now_s = time.monotonic()
        if self._missing_since_s is None:
            self._missing_since_s = now_s
        if now_s - self._missing_since_s >= self._timeout_s:
            raise NoRouterError(
                f"no router at {self._endpoint} for {self._timeout_s:g} s: "
                f"start one with `cogmap run` or `cogmap router`"
            )


@contextmanager
def observing(
    connect: str, agent: str, who: str | Member, subjects: Sequence[str] = READS
) -> Iterator[ZenohBus]:
    """Open a bus on which others see this process as `who`, a verb as `cli-verb`, with the keys of
    the first of `subjects`. Raises NoRouterError, AccessError.
    """
    bus = ZenohBus(connect, agent, keys=environment.keys(*subjects))
    try:
        bus.identify(who if isinstance(who, Member) else Member(CLI, f"{CLI}-{who}"))
        yield bus
    finally:
        bus.close()


def inspect_system(connect: str, agent: str, subjects: Sequence[str] = READS) -> System:
    """Find the processes of `agent`, and the topics that they use, with the keys of the first of
    `subjects`. Raises NoRouterError, AccessError.
    """
    session = open_client(connect, keys=environment.keys(*subjects))
    try:
        return discover(session, agent)
    finally:
        session.close()  # type: ignore[no-untyped-call]
