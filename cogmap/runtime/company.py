"""Lets a process end with another one: when a module has left the bus, and does not come back."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cogmap.bus.access.keys import Keys
from cogmap.bus.interface import Bus, Member
from cogmap.bus.zenoh_bus import ZenohBus

ABSENT_S = 10.0
"""A module whose router was killed is seen again sooner, once somebody has started that anew."""
AWAITED_S = 120.0
"""How long a module may take to come, which starts after this process on a busy machine."""


class Company:
    """Knows whether a module is there to stay for; any of its instances will do. Every time is in
    seconds of the monotonic clock, and this one is made at `now_s`.
    """

    def __init__(self, module: str, now_s: float) -> None:
        self._module = module
        self._present: set[Member] = set()
        self._alone_since_s = now_s
        self._patience_s = AWAITED_S

    def note(self, member: Member, alive: bool, now_s: float) -> None:
        """Take account of a member that came or left; those of other modules do not matter."""
        if member.module != self._module:
            return

        change = self._present.add if alive else self._present.discard
        change(member)
        self._alone_since_s = now_s
        self._patience_s = ABSENT_S

    def is_over(self, now_s: float) -> bool:
        """Decide whether the module has been away for ABSENT_S, or has not come in AWAITED_S."""
        alone_s = now_s - self._alone_since_s
        return not self._present and alone_s >= self._patience_s


def watch_company(bus: Bus, module: str) -> Callable[[], bool]:
    """Return what tells whether `module` has left `bus`, or never came; never so for an empty
    name.
    """
    if not module:
        return lambda: False

    company = Company(module, time.monotonic())
    bus.watch(lambda member, alive: company.note(member, alive, time.monotonic()))
    return lambda: company.is_over(time.monotonic())


@contextmanager
def company_at(
    endpoint: str, agent: str, module: str, keys: Keys | None = None
) -> Iterator[Callable[[], bool]]:
    """Watch `module` on a bus of its own, in a process that has none: see `watch_company`. Raises
    NoRouterError, AccessError.
    """
    if not module:
        yield lambda: False
        return

    bus = ZenohBus(endpoint, agent, keys=keys)
    try:
        yield watch_company(bus, module)
    finally:
        bus.close()
