"""The in-memory bus: many modules in one Python process, for experiments, replay and tests."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from cogmap.bus.codec import Envelope, decode_envelope
from cogmap.bus.depth import cached_messages
from cogmap.bus.incarnations import UNNAMED, Gate
from cogmap.bus.interface import Answer, Arrival, Incarnation, Job, Member, Past
from cogmap.errors import NoAnswerError
from cogmap.schemas.topics import Delivery, Topic

Handler = Callable[[bytes], Answer]
Watcher = Callable[[Member, bool], None]


@dataclass(frozen=True, eq=False)
class Subscription:
    """That a bus hands the messages of `topic` to `deliver`. None are ever lost here."""

    topic: Topic
    deliver: Callable[[Arrival], None]


class MemoryNetwork:
    """What the in-memory buses of one process share.

    A message is delivered to every subscriber before `publish` returns.
    """

    def __init__(self) -> None:
        self.subscribers: dict[Topic, list[Subscription]] = {}
        self.servers: dict[Topic, Handler] = {}
        self.pasts: dict[tuple[Topic, str], Past] = {}
        self.members: dict[Member, MemoryBus] = {}
        self.buses: list[MemoryBus] = []
        self.claims: list[tuple[Incarnation, MemoryBus]] = []
        self.watchers: list[Watcher] = []

    def deliver(self, arrival: Arrival) -> None:
        """Hand `arrival` to all who subscribe to its topic now."""
        for subscription in tuple(self.subscribers.get(arrival.topic, ())):
            subscription.deliver(arrival)

    def enter(self, member: Member, bus: MemoryBus) -> None:
        """Let the watchers know that `member` is ready."""
        self.members[member] = bus
        self._notify(member, True)

    def claim(self, incarnation: Incarnation, bus: MemoryBus) -> None:
        """Let every bus know that `bus` publishes as that incarnation."""
        self.claims.append((incarnation, bus))
        for each in tuple(self.buses):
            each.gate.note(incarnation, True)

    def withdraw(self, incarnation: Incarnation, bus: MemoryBus) -> None:
        """Let every bus know that `bus` publishes as that incarnation no more."""
        self.claims.remove((incarnation, bus))
        if incarnation in self.incarnations():
            return
        for each in tuple(self.buses):
            each.gate.note(incarnation, False)

    def incarnations(self) -> list[Incarnation]:
        """Return those that are claimed."""
        return sorted({incarnation for incarnation, _ in self.claims})

    def leave(self, bus: MemoryBus) -> None:
        """Let the watchers know that the members of `bus` are gone."""
        if bus in self.buses:
            self.buses.remove(bus)
        for incarnation in [each for each, owner in self.claims if owner is bus]:
            self.withdraw(incarnation, bus)
        gone = [member for member, other in self.members.items() if other is bus]
        for member in gone:
            del self.members[member]
            self._notify(member, False)

    def _notify(self, member: Member, alive: bool) -> None:
        for watcher in self.watchers:
            watcher(member, alive)


class MemoryBus:
    """One member's connection to `network`."""

    def __init__(self, network: MemoryNetwork) -> None:
        self.cache: dict[Topic, deque[Arrival]] = {}
        self.gate = Gate()
        self._network = network
        self._module = UNNAMED
        self._claimed: dict[str, Incarnation] = {}
        self._subscriptions: list[Subscription] = []
        self._served: list[Topic] = []
        self._past_of: list[tuple[Topic, str]] = []
        network.buses.append(self)
        for incarnation in network.incarnations():
            self.gate.note(incarnation, True)

    def declare(self, topic: Topic) -> None:
        if topic.delivery is Delivery.NEVER_DROP:
            self.cache.setdefault(topic, deque(maxlen=cached_messages(topic)))

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        claimed = self._claimed.get(envelope.source)
        if claimed is None or claimed.number != envelope.incarnation:
            self.claim(Incarnation(self._module, envelope.source, envelope.incarnation))

        arrival = Arrival(topic, payload, envelope, envelope.sent_ns)
        if topic in self.cache:
            self.cache[topic].append(arrival)
        self._network.deliver(arrival)

    def claim(self, incarnation: Incarnation) -> None:
        if self._module == UNNAMED:
            self._module = incarnation.module
        before = self._claimed.get(incarnation.source)
        self._claimed[incarnation.source] = incarnation
        if before is not None:
            self._network.withdraw(before, self)
        self._network.claim(incarnation, self)

    def incarnations(self) -> list[Incarnation]:
        return self._network.incarnations()

    def members(self) -> list[Member]:
        return sorted(self._network.members)

    def conflicts(self) -> list[str]:
        return self.gate.conflicts()

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        def receive(arrival: Arrival) -> None:
            self.gate.put(arrival, deliver)

        if history:
            self._deliver_past(topic, receive, history)

        subscription = Subscription(topic, receive)
        self._network.subscribers.setdefault(topic, []).append(subscription)
        self._subscriptions.append(subscription)

    def _deliver_past(self, topic: Topic, deliver: Callable[[Arrival], None], history: int) -> None:
        for bus in self._network.buses:
            past = list(bus.cache.get(topic, ()))
            for arrival in past[-history:]:
                deliver(arrival)

    def serve(
        self, request: Topic, reply: Topic, handler: Handler, enqueue: Callable[[Job], None]
    ) -> None:
        self._network.servers[request] = handler
        self._served.append(request)

    def query(self, request: Topic, payload: bytes, timeout_s: float) -> Answer:
        handler = self._network.servers.get(request)
        if handler is None:
            raise NoAnswerError(f"nobody answers {request.name}")
        try:
            return handler(payload)
        except Exception as error:
            raise NoAnswerError(f"{request.name}: {error}") from error

    def serve_past(self, topic: Topic, source: str, past: Past) -> None:
        self._network.pasts[topic, source] = past
        self._past_of.append((topic, source))

    def fetch_past(
        self, topic: Topic, source: str, first: int, last: int, timeout_s: float
    ) -> list[Arrival]:
        past = self._network.pasts.get((topic, source))
        if past is None:
            raise NoAnswerError(f"{source} does not answer for {topic.name}")
        now_ns = time.time_ns()
        sent = past(topic, first, last)
        return [
            Arrival(topic, each.payload, decode_envelope(each.envelope), now_ns) for each in sent
        ]

    def announce(self, member: Member) -> None:
        self._module = member.module
        self._network.enter(member, self)

    def watch(self, on_change: Watcher) -> None:
        self._network.watchers.append(on_change)
        for member in sorted(self._network.members):
            on_change(member, True)

    def close(self) -> None:
        while self._subscriptions:
            subscription = self._subscriptions.pop()
            self._network.subscribers[subscription.topic].remove(subscription)
        while self._served:
            self._network.servers.pop(self._served.pop(), None)
        while self._past_of:
            self._network.pasts.pop(self._past_of.pop(), None)
        self.gate.close()
        self._network.leave(self)
