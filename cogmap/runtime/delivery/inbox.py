"""What has arrived and is not processed yet."""

from __future__ import annotations

import threading
from collections import Counter
from queue import Empty, Queue

from cogmap.bus.interface import Arrival, Job
from cogmap.schemas.topics import Delivery

_Slot = tuple[str, str]


class Inbox:
    """Arrivals in order.

    Of a LATEST_WINS topic only the newest of each source stays, in the place of the one that it
    replaced; `superseded` counts those by topic. One that `keeps_all` replaces none: in lockstep
    somebody waits for an answer to each, and a message that is none may be the newest.
    """

    def __init__(self, *, keeps_all: bool = False) -> None:
        self._keeps_all = keeps_all
        # Not a SimpleQueue: where a wait of some microseconds is over before it has begun, that of
        # CPython 3.11 waits for ever.
        self._waiting: Queue[Arrival | Job | _Slot] = Queue()
        self._newest: dict[_Slot, Arrival] = {}
        self._replacing = threading.Lock()
        self.superseded: Counter[str] = Counter()

    def put(self, arrival: Arrival) -> None:
        """Enqueue; called from the bus's threads."""
        topic = arrival.topic
        is_replaceable = topic.delivery is Delivery.LATEST_WINS and not self._keeps_all
        if not is_replaceable or arrival.refused:
            self._waiting.put(arrival)
            return

        source = arrival.envelope.source if arrival.envelope else ""
        slot = (topic.name, source)
        with self._replacing:
            replaced = slot in self._newest
            self._newest[slot] = arrival

        if replaced:
            self.superseded[topic.name] += 1
        else:
            self._waiting.put(slot)

    def call(self, job: Job) -> None:
        """Enqueue something to do on the module's own thread, between messages."""
        self._waiting.put(job)

    def take(self, timeout_s: float | None) -> Arrival | Job | None:
        """Return the oldest arrival or job; None if none comes in `timeout_s` (None waits for
        ever).
        """
        try:
            item = self._waiting.get(timeout_s != 0, timeout_s)
        except Empty:
            return None
        if not isinstance(item, tuple):
            return item
        with self._replacing:
            return self._newest.pop(item)

    def __len__(self) -> int:
        return self._waiting.qsize()
