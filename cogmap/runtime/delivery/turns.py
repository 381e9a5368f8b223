"""Lets a source with a long backlog take turns with the others."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable

from cogmap.bus.interface import Arrival, Job
from cogmap.schemas.topics import Delivery

MOST_WAITING = 64
"""So many messages of one source wait in the order in which they came: more than in any cycle."""

Deliver = Callable[[Arrival], None]


class Turns:
    """Hands arrivals to `deliver`, the end of a queue. Of a source that has MOST_WAITING there it
    keeps the others, and has `receive` called with one of them in each pass through the queue, by
    what it hands to `call`: so nobody waits for the backlog of somebody else. Each source's own
    messages stay in order. LATEST_WINS topics have no backlog.
    """

    def __init__(self, deliver: Deliver, call: Callable[[Job], None], receive: Deliver) -> None:
        self._deliver = deliver
        self._call = call
        self._receive = receive
        self._waiting: Counter[str] = Counter()
        self._kept: deque[Arrival] = deque()
        self._kept_of: Counter[str] = Counter()
        self._lock = threading.Lock()

    def put(self, arrival: Arrival) -> None:
        """Take an arrival. Any thread may call this."""
        if not _is_counted(arrival):
            self._deliver(arrival)
            return

        source = _source(arrival)
        with self._lock:
            if self._kept_of[source] or self._waiting[source] >= MOST_WAITING:
                self._keep(arrival, source)
            else:
                self._waiting[source] += 1
                self._deliver(arrival)

    def taken(self, arrival: Arrival) -> None:
        """Note that an arrival has left the queue."""
        if not _is_counted(arrival):
            return
        source = _source(arrival)
        with self._lock:
            self._waiting[source] -= 1
            if self._waiting[source] <= 0:
                del self._waiting[source]

    def __len__(self) -> int:
        return len(self._kept)

    def _keep(self, arrival: Arrival, source: str) -> None:
        self._kept.append(arrival)
        self._kept_of[source] += 1
        if len(self._kept) == 1:
            self._call(self._take_turn)

    def _take_turn(self) -> None:
        with self._lock:
            arrival = self._kept.popleft()
            source = _source(arrival)
            self._kept_of[source] -= 1
            if not self._kept_of[source]:
                del self._kept_of[source]
            if self._kept:
                self._call(self._take_turn)
        self._receive(arrival)


def _is_counted(arrival: Arrival) -> bool:
    return arrival.topic.delivery is Delivery.NEVER_DROP


def _source(arrival: Arrival) -> str:
    """Return the source of an arrival; empty for those of whom it is not believed."""
    if arrival.refused or arrival.envelope is None:
        return ""
    return arrival.envelope.source
