"""Sheds floods: what one source sends of a topic far beyond all that the topic carries."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from cogmap.bus.codec import Envelope
from cogmap.bus.depth import KEPT_S, flow_of
from cogmap.bus.interface import Arrival
from cogmap.runtime.notes import note
from cogmap.schemas.topics import Topic

log = logging.getLogger("cogmap")

FASTEST = 100.0
"""So many times the usual rate are no flood: a recording may be played a hundred times as fast."""
CALM_S = 1.0
"""Once a flood is over, its source is heard again after so long."""
REFUSED_BURST = 100.0
REFUSED_HZ = 20.0
"""Of messages that are refused anyway, so many are read, to be logged: the others are counted."""
MAX_SOURCES = 4096
MAX_NOTES = 4
LOG_PERIOD_S = 10.0
_ANYBODY = ""

_Key = tuple[Topic, str, bool]


@dataclass
class _Budget:
    """How many messages may come: `burst` at once, and `rate_hz` on average.

    What comes beyond counts too: `left` falls below zero, and while a flood lasts none comes in.
    """

    burst: float
    rate_hz: float
    left: float
    at_s: float

    def admits(self, now_s: float) -> bool:
        """Take account of a message. Returns whether it may come in."""
        passed_s = now_s - self.at_s
        self.at_s = now_s
        self.left = min(self.burst, self.left + passed_s * self.rate_hz) - 1
        if self.left >= 0:
            return True
        self.left = max(self.left, -CALM_S * self.rate_hz)
        return False


@dataclass
class _Shed:
    """What was shed of a source on a topic: the last of it, how many, and when that was logged."""

    last: Envelope | None = None
    number: int = 0
    logged_s: float = -math.inf


class Flood:
    """Decides which arrivals come in: all but those of a flood. Any thread may call it.

    At once a source may send of a topic what one usually carries in KEPT_S, as the backlog of a
    process that was stopped, and FASTEST times its usual rate for as long as it likes. `shed`
    counts what was left out, by topic.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.shed: Counter[str] = Counter()
        self._budgets: dict[_Key, _Budget] = {}
        self._sheds: dict[_Key, _Shed] = {}
        self._lock = threading.Lock()

    def before(self, deliver: Callable[[Arrival], None]) -> Callable[[Arrival], None]:
        """Return what hands to `deliver` all that comes in."""

        def admit(arrival: Arrival) -> None:
            if self.admits(arrival):
                deliver(arrival)

        return admit

    def admits(self, arrival: Arrival) -> bool:
        """Take account of an arrival. Returns whether it comes in."""
        key = _key(arrival)
        now_s = self._clock()
        with self._lock:
            budget = self._budgets.get(key)
            if budget is None:
                budget = self._begin(key, now_s)
            if budget.admits(now_s):
                return True
            self._leave_out(key, arrival, now_s)
            return False

    def skipped(self, arrival: Arrival) -> Envelope | None:
        """Return the last message that was shed before `arrival`, of its source and topic, once:
        it and those before are not to be fetched.
        """
        envelope = arrival.envelope
        shed = self._sheds.get(_key(arrival))
        if envelope is None or shed is None or shed.last is None:
            return None

        with self._lock:
            last = shed.last
            is_after = envelope.incarnation != last.incarnation or envelope.seq > last.seq
            if not is_after:
                return None
            shed.last = None
        return last if envelope.incarnation == last.incarnation else None

    def notes(self) -> list[str]:
        """Say of whom how much was shed, the most first."""
        with self._lock:
            sheds = [(shed.number, key) for key, shed in self._sheds.items()]
        sheds.sort(key=lambda each: -each[0])
        notes = []
        for number, (topic, source, is_refused) in sheds[:MAX_NOTES]:
            if is_refused:
                wrong = f"{number} messages of {topic.name} were shed that would be refused anyway"
                notes.append(note(wrong, "see in the log who sends them"))
            else:
                wrong = f"{number} messages of {topic.name} of {source} were shed, as a flood"
                notes.append(note(wrong, f"end {source}"))
        return notes

    def _begin(self, key: _Key, now_s: float) -> _Budget:
        if len(self._budgets) >= MAX_SOURCES:
            del self._budgets[next(iter(self._budgets))]

        topic, _, is_refused = key
        rate_hz = FASTEST * flow_of(topic).rate_hz
        burst = KEPT_S * flow_of(topic).rate_hz
        if is_refused:
            rate_hz, burst = REFUSED_HZ, REFUSED_BURST
        budget = _Budget(burst, rate_hz, burst, now_s)
        self._budgets[key] = budget
        return budget

    def _leave_out(self, key: _Key, arrival: Arrival, now_s: float) -> None:
        """Count what is shed, and log it now and then."""
        if key not in self._sheds and len(self._sheds) >= MAX_SOURCES:
            del self._sheds[next(iter(self._sheds))]

        topic, source, is_refused = key
        shed = self._sheds.setdefault(key, _Shed())
        shed.number += 1
        shed.last = arrival.envelope
        self.shed[topic.name] += 1
        if not is_refused and now_s - shed.logged_s >= LOG_PERIOD_S:
            shed.logged_s = now_s
            log.warning("%s: %s sends a flood, which is shed", topic.name, source)


def _key(arrival: Arrival) -> _Key:
    """Return whose budget an arrival is taken from: all that is refused shares one, since anybody
    may state any source in it.
    """
    is_refused = bool(arrival.refused) or arrival.envelope is None
    if is_refused or arrival.envelope is None:
        return arrival.topic, _ANYBODY, True
    return arrival.topic, arrival.envelope.source, False
