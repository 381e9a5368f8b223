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
from cogmap.runtime.delivery.budget import Budget
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
ASKED_BURST = 100.0
ASKED_HZ = 50.0
"""So many requests are answered, whoever asks: more than all modules make that start together."""
ASKED_S = 0.01
"""An answer that takes longer counts as several: so a flood has at most half of a module's time."""
MAX_SENDERS = 4096
MAX_NOTES = 4
LOG_PERIOD_S = 10.0

_Key = tuple[Topic, str | None]


@dataclass(slots=True)
class _Sender:
    """A source of a topic, or all of whom messages are refused, and what may come of it.

    `shed` were left out, of them `last` the last, and that was logged at `logged_s`.
    """

    topic: Topic
    source: str
    is_refused: bool
    budget: Budget
    shed: int = 0
    last: Envelope | None = None
    logged_s: float = -math.inf

    def admits(self, now_s: float) -> bool:
        """Take account of a message. Returns whether it comes in.

        What does not come in counts too: while a flood lasts, none of it does.
        """
        budget = self.budget
        budget.refill(now_s)
        budget.spend(1, most_owed=CALM_S * budget.rate_hz)
        return budget.left >= 0

    def note(self) -> str:
        """Say how much of it was shed."""
        shed = f"{self.shed} messages of {self.topic.name}"
        if self.is_refused:
            wrong = f"{shed} were shed that would be refused anyway"
            return note(wrong, "see in the log who sends them")
        return note(f"{shed} of {self.source} were shed, as a flood", f"end {self.source}")


class Flood:
    """Decides which arrivals come in: all but those of a flood. Any thread may call it.

    At once a source may send of a topic what one usually carries in KEPT_S, as the backlog of a
    process that was stopped, and FASTEST times its usual rate for as long as it likes. `shed`
    counts what was left out, by topic.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.shed: Counter[str] = Counter()
        self._senders: dict[_Key, _Sender] = {}
        self._asked: dict[Topic, Budget] = {}
        self._lock = threading.Lock()

    def before(self, deliver: Callable[[Arrival], None]) -> Callable[[Arrival], None]:
        """Return what hands to `deliver` all that comes in."""

        def admit(arrival: Arrival) -> None:
            if self.admits(arrival):
                deliver(arrival)

        return admit

    def admits(self, arrival: Arrival) -> bool:
        """Take account of an arrival. Returns whether it comes in."""
        now_s = self._clock()
        with self._lock:
            sender = self._sender(arrival, now_s)
            if sender.admits(now_s):
                return True

            sender.shed += 1
            sender.last = arrival.envelope
            self.shed[sender.topic.name] += 1
            is_told = sender.is_refused or now_s < sender.logged_s + LOG_PERIOD_S
            if is_told:
                return False
            sender.logged_s = now_s

        log.warning("%s: %s sends a flood, which is shed", sender.topic.name, sender.source)
        return False

    def admits_request(self, request: Topic) -> bool:
        """Take account of a request: nobody knows whose. Returns whether it is answered."""
        now_s = self._clock()
        with self._lock:
            asked = self._asked.setdefault(request, Budget.full(ASKED_BURST, ASKED_HZ, now_s))
            asked.refill(now_s)
            is_answered = asked.left >= 1
            if is_answered:
                asked.spend(1, most_owed=0)
            return is_answered

    def answered(self, request: Topic, took_s: float) -> None:
        """Take account of the time that a request took, with the sending of its answer."""
        others = max(0.0, took_s / ASKED_S - 1)
        with self._lock:
            asked = self._asked.get(request)
            if asked is not None:
                asked.spend(others, most_owed=ASKED_BURST)

    def skipped(self, arrival: Arrival) -> Envelope | None:
        """Return the last message that was shed before `arrival`, of its source and topic, once:
        it and those before are not to be fetched.
        """
        sender = self._senders.get(_key(arrival))
        if sender is None or sender.last is None:
            return None

        with self._lock:
            last = sender.last
            envelope = arrival.envelope
            is_same_life = envelope is not None and envelope.incarnation == last.incarnation
            if is_same_life and envelope is not None and envelope.seq < last.seq:
                return None
            sender.last = None
        return last if is_same_life else None

    def notes(self) -> list[str]:
        """Say of whom how much was shed, the most first."""
        with self._lock:
            flooding = [sender for sender in self._senders.values() if sender.shed]
        flooding.sort(key=lambda sender: -sender.shed)
        return [sender.note() for sender in flooding[:MAX_NOTES]]

    def _sender(self, arrival: Arrival, now_s: float) -> _Sender:
        key = _key(arrival)
        sender = self._senders.get(key)
        if sender is not None:
            return sender

        if len(self._senders) >= MAX_SENDERS:
            del self._senders[next(iter(self._senders))]
        topic, source = key
        is_refused = source is None
        rate_hz, burst = REFUSED_HZ, REFUSED_BURST
        if not is_refused:
            usual_hz = flow_of(topic).rate_hz
            rate_hz, burst = FASTEST * usual_hz, KEPT_S * usual_hz
        budget = Budget.full(burst, rate_hz, now_s)
        sender = _Sender(topic, source or "", is_refused, budget)
        self._senders[key] = sender
        return sender


def _key(arrival: Arrival) -> _Key:
    """Return whose budget an arrival is taken from: all that is refused shares one, since anybody
    may state any source in it.
    """
    if arrival.refused or arrival.envelope is None:
        return arrival.topic, None
    return arrival.topic, arrival.envelope.source
