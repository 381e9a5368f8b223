"""Receives everything that is never dropped, and notes when."""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from itertools import pairwise

from cogmap.bus.interface import Arrival
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.recording.completeness import NEVER_DROP
from cogmap.schemas import topics

Stream = tuple[str, str, int]
"""A topic, a source and its incarnation."""


class Witness:
    """A subscriber that nobody stops. Its numbers say what there was to receive, its times how long
    others had to wait.
    """

    def __init__(self, endpoint: str, agent: str) -> None:
        self._numbers: dict[Stream, set[int]] = defaultdict(set)
        self._deltas_s: list[float] = []
        self._changing = threading.Lock()
        self._bus = ZenohBus(endpoint, agent)
        for topic in NEVER_DROP:
            if topic.keep_in_log:
                self._bus.subscribe(topic, self._note, _ignore)

    @property
    def deltas(self) -> int:
        """Return how many deltas have come."""
        return len(self._deltas_s)

    def numbers(self) -> dict[Stream, set[int]]:
        """Return the numbers that have come so far."""
        with self._changing:
            return {stream: set(numbers) for stream, numbers in self._numbers.items()}

    def gap_s(self, since_s: float, until_s: float) -> float:
        """Return the longest time without a delta between two moments."""
        with self._changing:
            within_s = [each for each in self._deltas_s if since_s <= each <= until_s]
        moments_s = [since_s, *within_s, until_s]
        return max(later_s - earlier_s for earlier_s, later_s in pairwise(moments_s))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()

    def _note(self, arrival: Arrival) -> None:
        envelope = arrival.envelope
        if envelope is None:
            return
        with self._changing:
            stream = arrival.topic.name, envelope.source, envelope.incarnation
            self._numbers[stream].add(envelope.seq)
            if arrival.topic is topics.DELTA:
                self._deltas_s.append(time.monotonic())


def _ignore(topic: str, number: int) -> None:
    """Do nothing: what this one misses, nobody asks it for."""
