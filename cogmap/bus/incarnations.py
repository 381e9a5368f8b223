"""One voice a source: which of its incarnations counts, by who is on the bus.

A process states by a liveliness token as which source it publishes, and since when. What a message
says of itself is compared with that: a message alone makes no incarnation.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from urllib.parse import quote, unquote

from cogmap.bus.interface import Arrival, Incarnation

log = logging.getLogger("cogmap")

HOLD_S = 1.0
"""How long a message waits for its source's token, which takes another way than it; and how long
one of the incarnation before is still accepted, which its successor's token has overtaken.
"""
MAX_HELD = 4096
MAX_HELD_BYTES = 64 * 2**20
"""How much may wait; the history of a few topics, of 1,024 messages each, fits."""
MAX_DEPARTED = 1024
"""Sources that have left, of which a message on its way is still accepted."""
UNNAMED = "unnamed"
"""The module of a process that publishes without having named itself."""
_EMPTY = "%"

Deliver = Callable[[Arrival], None]


def incarnation_key(agent: str, incarnation: Incarnation) -> str:
    """Return the key of the liveliness token that states an incarnation."""
    module, source = _chunk(incarnation.module), _chunk(incarnation.source)
    return f"{_root(agent)}/{module}/{source}/{incarnation.number}"


def every_incarnation(agent: str) -> str:
    """Return the key expression of the tokens of all incarnations."""
    return f"{_root(agent)}/**"


def read_incarnation(key: str) -> Incarnation | None:
    """Return the incarnation that the key of a token states, None if it is none."""
    *_, module, source, number = key.split("/")
    try:
        return Incarnation(_name(module), _name(source), int(number))
    except ValueError:
        return None


def _root(agent: str) -> str:
    return f"cogmap/{agent}/@incarnation"


def _chunk(name: str) -> str:
    """Write any name as one part of a key."""
    return quote(name, safe="") or _EMPTY


def _name(chunk: str) -> str:
    return "" if chunk == _EMPTY else unquote(chunk)


def when(number: int) -> str:
    """Say when an incarnation began; one that is no time of our days, as its number."""
    try:
        began = datetime.fromtimestamp(number / 1e9, UTC)
    except (OverflowError, ValueError, OSError):
        return str(number)
    return began.isoformat(timespec="milliseconds")


@dataclass
class _Source:
    """The incarnations of a source that are on the bus, in the order in which they were seen, and
    the one that counts: until it `is_heard` the oldest, and then that one for as long as it stays.
    What that of `before` has sent counts until `before_until_s`.
    """

    current: int
    present: list[int] = field(default_factory=list)
    is_heard: bool = False
    before: int | None = None
    before_until_s: float = 0.0

    def accepts(self, number: int, now_s: float) -> bool:
        """Decide whether a message of that incarnation counts."""
        if number == self.current:
            self.is_heard = True
            return True
        return number == self.before and now_s <= self.before_until_s

    def note(self, number: int, alive: bool, until_s: float) -> None:
        """Take account of an incarnation that came or left, and decide which one counts. What one
        that has a successor now has sent counts until `until_s`.
        """
        if alive and number not in self.present:
            self.present.append(number)
        if not alive and number in self.present:
            self.present.remove(number)
        if not self.present:
            return

        chosen = self.current
        if not self.is_heard:
            chosen = min(self.present)
        elif self.current not in self.present:
            chosen = self.present[0]
        if chosen == self.current:
            return

        if self.current not in self.present:
            self.before = self.current
            self.before_until_s = until_s
        self.current = chosen
        self.is_heard = False


@dataclass(slots=True)
class _Held:
    """A message that waits until `until_s` of the gate's clock."""

    arrival: Arrival
    deliver: Deliver
    until_s: float


class Gate:
    """Delivers what a source's present incarnation publishes, in order.

    A message of another one waits HOLD_S for the token that states it. It is delivered then or,
    if none came, as `refused`, with the reason. Any thread may call it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._sources: dict[str, _Source] = {}
        self._held: deque[_Held] = deque()
        self._held_bytes = 0
        self._timer: threading.Timer | None = None
        self._lock = threading.RLock()

    def put(self, arrival: Arrival, deliver: Deliver) -> None:
        """Hand `arrival` to `deliver`, now or later."""
        envelope = arrival.envelope
        if envelope is None:
            deliver(arrival)
            return

        with self._lock:
            source = self._sources.get(envelope.source)
            if source is not None and source.accepts(envelope.incarnation, self._clock()):
                deliver(arrival)
            elif self._has_room(arrival):
                self._hold(arrival, deliver)
            else:
                deliver(self._refused(arrival))

    def note(self, incarnation: Incarnation, alive: bool) -> None:
        """Take account of an incarnation that came or left, and deliver what waited for that."""
        name = incarnation.source
        number = incarnation.number
        with self._lock:
            source = self._sources.setdefault(name, _Source(number))
            source.note(number, alive, self._clock() + HOLD_S)
            if alive and len(source.present) > 1:
                log.warning("%s", _conflict(name, source))
            if not alive:
                # The last to leave is the last to be forgotten.
                self._sources[name] = self._sources.pop(name)
                self._forget()
            self._release(name, source)

    def conflicts(self) -> list[str]:
        """Say of each source as which several processes publish which one counts."""
        with self._lock:
            sources = sorted(self._sources.items())
        return [_conflict(name, source) for name, source in sources if len(source.present) > 1]

    def close(self) -> None:
        """Deliver nothing more that waits."""
        with self._lock:
            self._held.clear()
            self._held_bytes = 0
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None

    def expire(self) -> None:
        """Deliver as refused what has waited in vain."""
        with self._lock:
            now_s = self._clock()
            while self._held and self._held[0].until_s <= now_s:
                held = self._held.popleft()
                self._held_bytes -= len(held.arrival.payload)
                held.deliver(self._refused(held.arrival))

    def _has_room(self, arrival: Arrival) -> bool:
        size_bytes = self._held_bytes + len(arrival.payload)
        return len(self._held) < MAX_HELD and size_bytes <= MAX_HELD_BYTES

    def _hold(self, arrival: Arrival, deliver: Deliver) -> None:
        self._held.append(_Held(arrival, deliver, self._clock() + HOLD_S))
        self._held_bytes += len(arrival.payload)
        if self._timer is None:
            self._start_timer()

    def _start_timer(self) -> None:
        left_s = max(0.0, self._held[0].until_s - self._clock())
        self._timer = threading.Timer(left_s, self._on_timer)
        self._timer.daemon = True
        self._timer.start()

    def _on_timer(self) -> None:
        with self._lock:
            self.expire()
            self._timer = None
            if self._held:
                self._start_timer()

    def _release(self, name: str, source: _Source) -> None:
        """Deliver what waited for the incarnation that counts now."""
        waiting = self._held
        self._held = deque()
        for held in waiting:
            envelope = held.arrival.envelope
            assert envelope is not None
            if (envelope.source, envelope.incarnation) != (name, source.current):
                self._held.append(held)
                continue

            source.is_heard = True
            self._held_bytes -= len(held.arrival.payload)
            held.deliver(held.arrival)

    def _forget(self) -> None:
        """Forget the sources that left first, if there are many."""
        departed = [name for name, source in self._sources.items() if not source.present]
        for name in departed[:-MAX_DEPARTED]:
            del self._sources[name]

    def _refused(self, arrival: Arrival) -> Arrival:
        """Return `arrival` with the reason why it does not count."""
        envelope = arrival.envelope
        assert envelope is not None
        claim = f"it says it is of {envelope.source!r}, started at {when(envelope.incarnation)}"
        reason = f"{claim}, which is not on the bus"
        source = self._sources.get(envelope.source)
        if source is not None and envelope.incarnation in source.present:
            reason = f"{claim}, while the one started at {when(source.current)} is on the bus"
        return replace(arrival, refused=reason)


def _conflict(name: str, source: _Source) -> str:
    others = [when(number) for number in source.present if number != source.current]
    return (
        f"{len(source.present)} processes publish as {name}: the one started at "
        f"{when(source.current)} counts, and what that of {', '.join(others)} publishes is refused"
    )
