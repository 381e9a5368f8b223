"""Who is ready among those that a module requires."""

from __future__ import annotations

from collections import Counter

from cogmap.bus.interface import Member


class Roster:
    """The members that are ready now, beside the numbers of instances that are required."""

    def __init__(self, required: dict[str, int]) -> None:
        self._required = required
        self._ready: set[Member] = set()

    def update(self, member: Member, alive: bool) -> None:
        """Note that `member` became ready, or left."""
        if alive:
            self._ready.add(member)
        else:
            self._ready.discard(member)

    @property
    def missing(self) -> dict[str, int]:
        """Return the required modules that are not ready, and how many instances are missing."""
        ready = Counter(member.module for member in self._ready)
        missing = {}
        for name, number in self._required.items():
            if ready[name] < number:
                missing[name] = number - ready[name]
        return missing
