"""What came and has not been taken in yet."""

from __future__ import annotations

import threading
from collections import Counter, OrderedDict
from itertools import count

from bus.interface import Arrival, Job
from schemas.topics import Delivery

_Key = tuple[str, str] | int


class Inbox:
    """Arrivals in order. Of a LATEST_WINS topic only each source's newest stays; what it replaced is counted."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[_Key, Arrival | Job] = OrderedDict()
        self._changed = threading.Condition()
        self._ticket = count()
        self.superseded: Counter[str] = Counter()

    def put(self, arrival: Arrival) -> None:
        """Enqueue; called from the bus's threads."""
        key: _Key = next(self._ticket)
        if arrival.topic.delivery is Delivery.LATEST_WINS:
            key = (arrival.topic.name, arrival.envelope.source if arrival.envelope else "")
        with self._changed:
            if self._waiting.pop(key, None) is not None:
                self.superseded[arrival.topic.name] += 1
            self._waiting[key] = arrival
            self._changed.notify()

    def call(self, job: Job) -> None:
        """Enqueue something to do on the module's own thread, between messages."""
        with self._changed:
            self._waiting[next(self._ticket)] = job
            self._changed.notify()

    def take(self, timeout_s: float | None) -> Arrival | Job | None:
        """The oldest arrival or job; None if there is none within `timeout_s` (None waits for ever)."""
        with self._changed:
            if not self._waiting and timeout_s != 0:
                self._changed.wait_for(lambda: bool(self._waiting), timeout_s)
            return self._waiting.popitem(last=False)[1] if self._waiting else None

    def __len__(self) -> int:
        return len(self._waiting)
