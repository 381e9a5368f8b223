"""The in-memory bus: many modules in one Python process, for experiments, replay and tests."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from cogmap.bus.codec import Envelope
from cogmap.bus.interface import CACHED_MESSAGES, Answer, Arrival, Job, Member
from cogmap.errors import NoAnswerError
from schemas.topics import Delivery, Topic

_Subscriber = tuple[Callable[[Arrival], None], Callable[[str, int], None]]


class MemoryNetwork:
    """What the in-memory buses of one experiment share. Each message is delivered before `publish`
    returns.
    """

    def __init__(self) -> None:
        self.subscribers: dict[Topic, list[_Subscriber]] = {}
        self.servers: dict[Topic, Callable[[bytes], Answer]] = {}
        self.members: dict[Member, MemoryBus] = {}
        self.buses: list[MemoryBus] = []
        self.watchers: list[Callable[[Member, bool], None]] = []

    def change(self, member: Member, bus: MemoryBus | None) -> None:
        """Enter `member`, or take it out where `bus` is None, and tell the watchers."""
        if bus is not None:
            self.members[member] = bus
        elif self.members.pop(member, None) is None:
            return
        for watcher in self.watchers:
            watcher(member, bus is not None)


class MemoryBus:
    """One member's connection to a MemoryNetwork."""

    def __init__(self, network: MemoryNetwork) -> None:
        self._network = network
        self.said: dict[Topic, deque[Arrival]] = {}
        network.buses.append(self)
        self._subscriptions: list[tuple[Topic, _Subscriber]] = []
        self._served: list[Topic] = []

    def declare(self, topic: Topic) -> None:
        if topic.delivery is Delivery.NEVER_DROP:
            self.said.setdefault(topic, deque(maxlen=CACHED_MESSAGES))

    def publish(self, topic: Topic, payload: bytes, envelope: Envelope) -> None:
        arrival = Arrival(topic, payload, envelope, envelope.sent_ns)
        if topic in self.said:
            self.said[topic].append(arrival)
        for deliver, _ in tuple(self._network.subscribers.get(topic, ())):
            deliver(arrival)

    def subscribe(
        self,
        topic: Topic,
        deliver: Callable[[Arrival], None],
        on_gap: Callable[[str, int], None],
        history: int = 0,
    ) -> None:
        subscriber = (deliver, on_gap)
        for bus in self._network.buses if history else ():
            for arrival in list(bus.said.get(topic, ()))[-history:]:
                deliver(arrival)
        self._network.subscribers.setdefault(topic, []).append(subscriber)
        self._subscriptions.append((topic, subscriber))

    def serve(
        self,
        request: Topic,
        reply: Topic,
        handler: Callable[[bytes], Answer],
        enqueue: Callable[[Job], None],
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

    def announce(self, member: Member) -> None:
        self._network.change(member, self)

    def watch(self, on_change: Callable[[Member, bool], None]) -> None:
        self._network.watchers.append(on_change)
        for member in sorted(self._network.members):
            on_change(member, True)

    def close(self) -> None:
        while self._subscriptions:
            topic, subscriber = self._subscriptions.pop()
            self._network.subscribers[topic].remove(subscriber)
        while self._served:
            self._network.servers.pop(self._served.pop(), None)
        if self in self._network.buses:
            self._network.buses.remove(self)
        for member in [m for m, bus in self._network.members.items() if bus is self]:
            self._network.change(member, None)
