"""Who is there to be given work: whoever is ready on the bus, and reports its health."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from cogmap.bus.interface import Member

START_S = 30.0
"""While those who start together come one after another, each counts at once."""
FIRST_BEAT_S = 3.0
"""Health comes once a second; one without any by then is only a token."""
SILENCE_S = 30.0
"""No task keeps a worker from reporting for so long. Whose process is stopped or dead leaves the
bus within the 10 s of Zenoh's lease.
"""
MAX_EARLY = 256

Change = tuple[Member, bool]


@dataclass
class _Ready:
    """A member on the bus: whether it counts as present, and until when it must report."""

    until_s: float
    is_present: bool = False
    has_beaten: bool = False


class Heartbeats:
    """Decides which members count as present; every time is in seconds of the monotonic clock.

    Members of `modules` must report their health: one that comes later than START_S after
    `began_s` counts from its first report on, one that comes earlier at once, but no longer than
    FIRST_BEAT_S without one; and none longer than SILENCE_S after its last. Others count by being
    ready alone. What is returned are the changes, in order.
    """

    def __init__(self, modules: Collection[str], began_s: float) -> None:
        self._modules = frozenset(modules)
        self._began_s = began_s
        self._ready: dict[Member, _Ready] = {}
        self._early: dict[Member, float] = {}

    def note(self, member: Member, alive: bool, now_s: float) -> list[Change]:
        """Take account of a member that became ready, or left."""
        if member.module not in self._modules:
            return [(member, alive)]

        if not alive:
            gone = self._ready.pop(member, None)
            return [(member, False)] if gone is not None and gone.is_present else []

        ready = self._ready.setdefault(member, _Ready(now_s + FIRST_BEAT_S))
        beat_s = self._early.pop(member, None)
        if beat_s is not None:
            return self.beat(member, beat_s)
        if now_s - self._began_s <= START_S and not ready.is_present:
            ready.is_present = True
            return [(member, True)]
        return []

    def beat(self, member: Member, now_s: float) -> list[Change]:
        """Take account of a report of health: one that comes before its member counts then."""
        if member.module not in self._modules:
            return []

        ready = self._ready.get(member)
        if ready is None:
            self._early[member] = now_s
            if len(self._early) > MAX_EARLY:
                del self._early[next(iter(self._early))]
            return []

        ready.until_s = now_s + SILENCE_S
        ready.has_beaten = True
        if ready.is_present:
            return []
        ready.is_present = True
        return [(member, True)]

    def expire(self, now_s: float) -> list[Change]:
        """Take account of those that have not reported in time."""
        changes = []
        for member, ready in self._ready.items():
            if ready.is_present and now_s > ready.until_s:
                ready.is_present = False
                changes.append((member, False))
        return changes

    def notes(self, now_s: float) -> list[str]:
        """Say who is ready and does not count."""
        notes = []
        for member, ready in sorted(self._ready.items()):
            if ready.is_present or now_s <= ready.until_s:
                continue
            since = f"for {SILENCE_S:g} s" if ready.has_beaten else "at all"
            notes.append(
                f"{member.module}/{member.instance} is on the bus and has reported no health "
                f"{since}: it gets no tasks until it does"
            )
        return notes
