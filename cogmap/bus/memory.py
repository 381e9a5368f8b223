"""The in-memory bus: many modules in one Python process, for experiments, replay and tests."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from cogmap.bus.codec import Envelope, decode_envelope
from cogmap.bus.depth import cached_messages
from cogmap.bus.interface import Answer, Arrival, Job, Member, Past
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
        self.watchers: list[Watcher] = []

    def deliver(self, arrival: Arrival) -> None:
        """Hand `arrival` to all who subscribe to its topic now."""
        for subscription in tuple(self.subscribers.get(arrival.topic, ())):
            subscription.deliver(arrival)

    def enter(self, member: Member, bus: MemoryBus) -> None:
        """Let the watchers know that `member` is ready."""
        self.members[member] = bus
        self._notify(member, True)

    def leave(self, bus: MemoryBus) -> None:
        """Let the watchers know that the members of `bus` are gone."""
        if bus in self.buses:
            self.buses.remove(bus)
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
        self._network = network
        self._subscriptions: list[Subscription] = []
        self._served: list[Topic] = []
        self._past_of: list[tuple[Topic, str]] = []
        network.buses.append(self)

    def declare(self, topic: Topic) -> None:
        if topic.delivery is Delivery.NEVER_DROP:
            self.cache.setdefault(topic, deque(maxlen=cached_messages(topic)))

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        arrival = Arrival(topic, payload, envelope, envelope.sent_ns)
        if topic in self.cache:
            self.cache[topic].append(arrival)
        self._network.deliver(arrival)

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        if history:
            self._deliver_past(topic, deliver, history)

        subscription = Subscription(topic, deliver)
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
        self._network.leave(self)
