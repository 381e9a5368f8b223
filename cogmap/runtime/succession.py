"""Lets a process take its place on the bus only once nobody else has it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

from cogmap.bus.incarnations import when
from cogmap.bus.interface import Bus, Incarnation, Member
from cogmap.errors import UsageError
from cogmap.runtime.module import Module

log = logging.getLogger("cogmap")

TIMEOUT_S = 12.0
"""Whoever was killed has left at once; whose link was lost, after Zenoh's lease of 10 s."""
POLL_S = 0.05


def is_single(module: Module) -> bool:
    """Decide whether no second process may publish beside one of this module: what it publishes on
    a topic that is not shared would contradict the other's.
    """
    return any(not topic.shared for topic in module.emits)


@dataclass(frozen=True)
class Place:
    """The place of `module`, which began as its incarnation `number`: its name and, if it
    `is_single`, its module.
    """

    module: Module
    number: int
    is_single: bool = False

    @property
    def incarnation(self) -> Incarnation:
        """Return the incarnation of whoever takes it."""
        return Incarnation(self.module.name, self.module.instance, self.number)

    def others(self, bus: Bus) -> dict[str, int | None]:
        """Return who else is in it, with its incarnation, if it states one.

        Of two that start at once, only the later one has to wait for the earlier.
        """
        own = self.incarnation
        ready = set(bus.members())
        found: dict[str, int | None] = {}
        for member in ready:
            if self.is_single and member.module == own.module and member.instance != own.source:
                found[member.instance] = None

        for each in bus.incarnations():
            is_here = each.source == own.source
            is_here |= self.is_single and each.module == own.module
            is_first = Member(each.module, each.source) in ready or each.number < own.number
            if each != own and is_here and is_first:
                found[each.source] = each.number
        return found

    def refusal(self, others: dict[str, int | None]) -> str:
        """Say who is in it, and what to do."""
        remedy = "end it first, or give this one a name of its own with --instance"
        if self.is_single:
            remedy = "end it first, or give this one an agent of its own with --agent"
        return (
            f"{_named(others)} is on the bus already, and a second {self.module.name} would "
            f"contradict it: {remedy}"
        )


def _named(others: dict[str, int | None]) -> str:
    names = []
    for name, number in sorted(others.items()):
        began = "" if number is None else f", started at {when(number)}"
        names.append(f"{name}{began}")
    return " and ".join(names)


def take_place(
    bus: Bus,
    place: Place,
    is_asked_to_end: Callable[[], bool] = lambda: False,
    timeout_s: float = TIMEOUT_S,
) -> None:
    """Claim a place, and wait until nobody else is in it.

    Raises UsageError that names who is there, if that stays, and KeyboardInterrupt once it is asked
    to end.
    """
    bus.claim(place.incarnation)
    until_s = time.monotonic() + timeout_s
    is_waiting = False
    while others := place.others(bus):
        if time.monotonic() >= until_s:
            raise UsageError(place.refusal(others))
        if is_asked_to_end():
            raise KeyboardInterrupt
        if not is_waiting:
            log.info("%s waits for %s to leave", place.module.instance, _named(others))
        is_waiting = True
        time.sleep(POLL_S)
