"""Networks of both kinds, peers on them, and ways to wait without sleeping."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Protocol

import zenoh

from cogmap.bus.codec import Envelope, decode, decode_envelope, encode
from cogmap.bus.interface import Arrival, Bus, Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.bus.session import free_endpoint, open_client, open_router
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import MessageError
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Health
from cogmap.schemas.topics import Topic

TIMEOUT_S = 20.0
INCARNATION = 1
BLOCK = zenoh.CongestionControl.BLOCK
_numbers = itertools.count()


@contextmanager
def routed() -> Iterator[str]:
    """The endpoint of a router that is there meanwhile."""
    address = free_endpoint()
    router = open_router(address)
    try:
        yield address
    finally:
        router.close()  # type: ignore[no-untyped-call]


class Network(Protocol):
    """Where the members of one test meet."""

    def join(self) -> Bus: ...

    def put(self, topic: Topic, payload: bytes, attachment: bytes | None) -> None:
        """Send bytes past every check, as a stranger would."""

    def close(self) -> None: ...


class InMemory:
    """Members in this process."""

    def __init__(self) -> None:
        self.network = MemoryNetwork()
        self.buses: list[MemoryBus] = []

    def join(self) -> MemoryBus:
        bus = MemoryBus(self.network)
        self.buses.append(bus)
        return bus

    def put(self, topic: Topic, payload: bytes, attachment: bytes | None) -> None:
        try:
            envelope = decode_envelope(attachment)
        except MessageError:
            envelope = None
        self.network.deliver(Arrival(topic, payload, envelope, time.time_ns()))

    def close(self) -> None:
        for bus in self.buses:
            bus.close()


class OverZenoh:
    """Members at a router, under an agent's name of their own."""

    def __init__(self, endpoint: str) -> None:
        self.endpoint = endpoint
        self.agent = f"contract{next(_numbers)}"
        self.buses: list[ZenohBus] = []
        self.stranger: zenoh.Session | None = None

    def join(self) -> ZenohBus:
        bus = ZenohBus(self.endpoint, self.agent)
        self.buses.append(bus)
        return bus

    def put(self, topic: Topic, payload: bytes, attachment: bytes | None) -> None:
        if self.stranger is None:
            self.stranger = open_client(self.endpoint)
        key = topic.key(self.agent)
        self.stranger.put(key, payload, attachment=attachment, congestion_control=BLOCK)

    def close(self) -> None:
        for bus in self.buses:
            bus.close()
        if self.stranger is not None:
            self.stranger.close()


class Peer:
    """A member that takes what it has received only when asked."""

    def __init__(self, bus: Bus, *subscribed: Topic, history: int = 0) -> None:
        self.bus = bus
        self.inbox = Inbox()
        self.arrived = 0
        self._changed = threading.Condition()
        for topic in subscribed:
            bus.subscribe(topic, self._deliver, lambda topic, number: None, history)

    def _deliver(self, arrival: Arrival) -> None:
        self.inbox.put(arrival)
        with self._changed:
            self.arrived += 1
            self._changed.notify_all()

    def wait_for(self, number: int) -> None:
        """Wait until so many have arrived, taken or not."""
        with self._changed:
            arrived = self._changed.wait_for(lambda: self.arrived >= number, TIMEOUT_S)
        assert arrived, f"{self.arrived} of {number}"

    def take(self, number: int) -> list[Arrival]:
        """The next `number` arrivals."""
        taken = []
        for _ in range(number):
            arrival = self.inbox.take(TIMEOUT_S)
            assert isinstance(arrival, Arrival), f"{len(taken)} of {number}"
            taken.append(arrival)
        return taken

    def take_seqs(self, number: int) -> list[int]:
        """The numbers of the next `number` arrivals, each of which has an envelope."""
        seqs = []
        for arrival in self.take(number):
            assert arrival.envelope is not None
            seqs.append(arrival.envelope.seq)
        return seqs


def meet(here: Bus, *others: Bus) -> None:
    """Wait until `here` knows that the others are ready: what it publishes from now on reaches
    them.
    """
    members = [Member("peer", f"peer{next(_numbers)}") for _ in others]
    await_members(here, *members, then=lambda: _announce(members, others))


def _announce(members: list[Member], buses: Iterable[Bus]) -> None:
    for member, bus in zip(members, buses, strict=True):
        bus.announce(member)


def await_members(here: Bus, *members: Member, then: Callable[[], None] = lambda: None) -> None:
    """Call `then`, and wait until `here` knows that the members are ready."""
    seen: set[Member] = set()
    changed = threading.Condition()

    def on_change(member: Member, alive: bool) -> None:
        with changed:
            seen.add(member)
            changed.notify_all()

    here.watch(on_change)
    then()
    missing = set(members)
    with changed:
        are_ready = changed.wait_for(lambda: missing <= seen, TIMEOUT_S)
    assert are_ready, f"only {seen} are ready"


def spin_until(condition: Callable[[], bool], *shells: Shell) -> None:
    """Spin the shells in turn until `condition` holds."""
    deadline_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline_s, "the condition never held"
        for shell in shells:
            shell.spin_once(0.01)


def next_health(peer: Peer, shell: Shell) -> Health:
    """Spin `shell` until `peer` has a report that it made from now on.

    Earlier ones may still be under way.
    """
    now_ns = time.time_ns()
    while True:
        spin_until(lambda: len(peer.inbox) > 0, shell)
        (arrival,) = peer.take(1)
        health = decode(topics.HEALTH, arrival.payload)
        assert isinstance(health, Health)
        if health.stamp_ns >= now_ns:
            return health


@contextmanager
def working(shell: Shell) -> Iterator[None]:
    """Run `shell` on a thread of its own."""
    ended = threading.Event()

    def work() -> None:
        while not ended.is_set():
            shell.spin_once(0.01)

    shell.open()
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        shell.close()


def envelope_of(message: Message, incarnation: int = INCARNATION) -> Envelope:
    now_ns = time.time_ns()
    return Envelope(message.source, message.seq, incarnation, now_ns, now_ns)


def publish(bus: Bus, *messages: Message, incarnation: int = INCARNATION) -> None:
    """Publish messages that are numbered already."""
    for message in messages:
        envelope = envelope_of(message, incarnation)
        bus.publish(topics.of(message), encode(message), envelope)
