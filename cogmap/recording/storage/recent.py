"""The messages of the last seconds, for a snapshot that somebody asks for afterwards."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from cogmap.bus.interface import Arrival
from cogmap.recording.storage.write_queue import size_bytes


class Recent:
    """Arrivals of the last `span_s`, at most `limit_bytes` of them; the oldest go first."""

    def __init__(self, span_s: float, limit_bytes: int) -> None:
        self._span_ns = span_s * 1e9
        self._limit_bytes = limit_bytes
        self._bytes = 0
        self._arrivals: deque[Arrival] = deque()

    def __len__(self) -> int:
        return len(self._arrivals)

    def put(self, arrival: Arrival) -> Iterator[Arrival]:
        """Add the newest, and yield those that have become too old or find no room."""
        self._arrivals.append(arrival)
        self._bytes += size_bytes(arrival)
        while self._bytes > self._limit_bytes or self._is_too_old(arrival.received_ns):
            oldest = self._arrivals.popleft()
            self._bytes -= size_bytes(oldest)
            yield oldest

    def take_all(self) -> Iterator[Arrival]:
        """Yield all, the oldest first, and forget them."""
        while self._arrivals:
            yield self._arrivals.popleft()
        self._bytes = 0

    def _is_too_old(self, now_ns: int) -> bool:
        return bool(self._arrivals) and now_ns - self._arrivals[0].received_ns > self._span_ns
