"""What a command waits for in lockstep, so that it depends on nothing but what was sensed. Pure."""

from __future__ import annotations

from schemas.cognition import Competition


class LockstepGate:
    """Open for a pose when the scan and the self-motion of its view have come, and the competition
    of the cycle before with its broadcast, if there was one.
    """

    def __init__(self) -> None:
        self.scan_ns = -1
        self.motion_ns = -1
        self._competition_cycle = 0
        self._broadcast_cycle = 0
        self._awaits_broadcast = False

    def on_competition(self, competition: Competition) -> None:
        """The global workspace has come so far."""
        self._competition_cycle = competition.cycle
        self._awaits_broadcast = bool(competition.trigger)

    def on_broadcast(self, cycle: int) -> None:
        """The broadcast of `cycle` has come."""
        self._broadcast_cycle = cycle

    def resume(self, cycle: int) -> None:
        """After a restart at `cycle`: wait for nothing that was published before."""
        self._competition_cycle = max(self._competition_cycle, cycle - 1)
        self._awaits_broadcast = False

    def is_open(self, stamp_ns: int, cycle: int) -> bool:
        """Whether the command for the pose of `stamp_ns` in `cycle` may be computed."""
        has_senses = min(self.scan_ns, self.motion_ns) >= stamp_ns
        has_competition = self._competition_cycle >= cycle - 1
        is_behind = self._broadcast_cycle < self._competition_cycle
        lacks_broadcast = self._awaits_broadcast and is_behind

        return has_senses and has_competition and not lacks_broadcast
