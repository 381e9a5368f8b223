"""What a command waits for in lockstep, so that it depends on nothing but what was sensed. Pure."""

from __future__ import annotations

from cogmap.schemas.cognition import Competition


class LockstepGate:
    """Open for a pose when the scan and the self-motion of its view have come, and the competition
    of the cycle before with the action selection for its broadcast, if there was one.
    """

    def __init__(self) -> None:
        self.scan_ns = -1
        self.motion_ns = -1
        self._competition_cycle = 0
        self._action_cycle = 0
        self._unanswered: set[int] = set()

    def on_competition(self, competition: Competition) -> None:
        """Note how far the global workspace has come: there is no later cycle than this."""
        self._competition_cycle = competition.cycle
        self._unanswered = {each for each in self._unanswered if each <= competition.cycle}
        if competition.trigger and competition.cycle > self._action_cycle:
            self._unanswered.add(competition.cycle)

    def on_action(self, cycle: int) -> None:
        """Note that what was selected for the broadcast of `cycle` has come."""
        self._action_cycle = cycle
        self._unanswered = {each for each in self._unanswered if each > cycle}

    def resume(self, cycle: int) -> None:
        """Go on at `cycle`, after a restart, or if something was lost: wait for nothing that was
        published before.
        """
        self._competition_cycle = max(self._competition_cycle, cycle - 1)
        self._unanswered = {each for each in self._unanswered if each >= cycle}

    def is_open(self, stamp_ns: int, cycle: int) -> bool:
        """Decide whether the command for the pose of `stamp_ns` in `cycle` may be computed."""
        has_senses = min(self.scan_ns, self.motion_ns) >= stamp_ns
        has_competition = self._competition_cycle >= cycle - 1
        has_action = not any(each < cycle for each in self._unanswered)
        return has_senses and has_competition and has_action
