"""What the end of a cycle waits for in lockstep, so that what memory does depends on nothing but
what was sensed. Pure.
"""

from __future__ import annotations

from cogmap.schemas.cognition import Broadcast, Competition


class LockstepGate:
    """Open for a cycle once the competition of the cycle before has come, and its broadcast, if
    there was one.
    """

    def __init__(self) -> None:
        self._competition_cycle = 0
        self._broadcast_cycle = 0
        self._awaits_broadcast = False

    def on_competition(self, competition: Competition) -> None:
        """The global workspace has come so far."""
        self._competition_cycle = competition.cycle
        self._awaits_broadcast = bool(competition.trigger)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """A broadcast has come."""
        self._broadcast_cycle = broadcast.cycle

    def is_open(self, cycle: int) -> bool:
        """Whether what the end of `cycle` leads to may be computed."""
        is_behind = self._broadcast_cycle < self._competition_cycle
        lacks_broadcast = self._awaits_broadcast and is_behind
        return self._competition_cycle >= cycle - 1 and not lacks_broadcast
