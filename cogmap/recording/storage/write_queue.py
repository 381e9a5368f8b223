"""What a recorder has received and not yet written."""

from __future__ import annotations

import threading
from collections import Counter, deque

from cogmap.bus.interface import Arrival, Job
from cogmap.schemas.topics import Delivery

# A minute's worth of a drive; and what an arrival takes beside its payload, about.
LIMIT_BYTES = 256 * 2**20
_OVERHEAD_BYTES = 1024


class WriteQueue:
    """Arrivals in order, every one kept, up to `limit_bytes` in all; the rest is counted by topic.

    LATEST_WINS topics, which the images are, may fill half of it: the rest is for what must never
    be dropped.
    """

    def __init__(self, limit_bytes: int = LIMIT_BYTES) -> None:
        self.dropped: Counter[str] = Counter()
        self.peak_bytes = 0
        self._limit_bytes = limit_bytes
        self._bytes = 0
        self._waiting: deque[Arrival | Job] = deque()
        self._changed = threading.Condition()

    def put(self, arrival: Arrival) -> None:
        """Enqueue; called from the bus's threads."""
        size = size_bytes(arrival)
        never_drop = arrival.topic.delivery is Delivery.NEVER_DROP
        room = self._limit_bytes if never_drop else self._limit_bytes // 2

        with self._changed:
            if self._bytes + size > room:
                self.dropped[arrival.topic.name] += 1
                return
            self._bytes += size
            self.peak_bytes = max(self.peak_bytes, self._bytes)
            self._waiting.append(arrival)
            self._changed.notify()

    def call(self, job: Job) -> None:
        """Enqueue something to do on the recorder's own thread."""
        with self._changed:
            self._waiting.append(job)
            self._changed.notify()

    def take(self, timeout_s: float | None) -> Arrival | Job | None:
        """Return the oldest arrival or job; None if none comes within `timeout_s` (None: no
        limit).
        """
        with self._changed:
            if not self._waiting and timeout_s != 0:
                self._changed.wait_for(lambda: bool(self._waiting), timeout_s)
            if not self._waiting:
                return None

            item = self._waiting.popleft()
            if isinstance(item, Arrival):
                self._bytes -= size_bytes(item)
            return item


def size_bytes(arrival: Arrival) -> int:
    """Return about how much memory an arrival takes."""
    return len(arrival.payload) + _OVERHEAD_BYTES
