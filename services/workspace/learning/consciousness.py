"""What became conscious, kept until the next cycle begins, which learns from it."""

from __future__ import annotations

from cogmap.schemas.cognition import Broadcast, Competition


class Consciousness:
    """The broadcasts since the cycle before.

    Where they are `awaited`, in lockstep, a cycle waits for the competition of the cycle before,
    and its broadcast if it led to one: what it learns does not depend on what arrives first.
    """

    def __init__(self, awaited: bool) -> None:
        self._awaited = awaited
        self._broadcasts: dict[int, Broadcast] = {}
        self._learned_cycle = 0
        self._competition_cycle = 0
        self._had_broadcast = False

    def restore(self, cycle: int) -> None:
        """Resume in `cycle` after a restart: wait for no competition before, which may never come,
        and learn nothing twice.
        """
        self._learned_cycle = max(0, cycle - 1)
        self._competition_cycle = cycle

    def on_competition(self, competition: Competition) -> None:
        """Note how far the global workspace has come."""
        if competition.cycle >= self._competition_cycle:
            self._competition_cycle = competition.cycle
            self._had_broadcast = bool(competition.trigger)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Keep a broadcast that nothing was learned from yet."""
        if broadcast.cycle > self._learned_cycle:
            self._broadcasts[broadcast.cycle] = broadcast

    def complete(self, ended_cycle: int) -> bool:
        """Decide whether all that came of the cycle that has ended is known."""
        if not self._awaited:
            return True
        if self._competition_cycle < ended_cycle:
            return False

        is_learned = self._competition_cycle <= self._learned_cycle
        return not self._had_broadcast or is_learned or ended_cycle in self._broadcasts

    def take(self, ended_cycle: int) -> list[Broadcast]:
        """Take the broadcasts up to that of `ended_cycle`, in their order, once each."""
        cycles = sorted(cycle for cycle in self._broadcasts if cycle <= ended_cycle)
        taken = [self._broadcasts.pop(cycle) for cycle in cycles]
        self._learned_cycle = max(self._learned_cycle, ended_cycle)
        return taken
