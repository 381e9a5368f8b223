"""What the body senses of itself, as needs in the Workspace."""

from __future__ import annotations

from cogmap.runtime.run import Run
from cogmap.schemas.nodes import ENERGY, Need, need_id
from cogmap.schemas.sensing import Energy

MAX_KEPT = 16


class Body:
    """The newest of what the body sensed, of which each cycle takes that of its view.

    In lockstep a cycle does not begin before it has come, if the robot has a battery.
    """

    def __init__(self, run: Run) -> None:
        self._awaited = run.lockstep and run.energy
        self._sensed: dict[int, Energy] = {}

    def put(self, energy: Energy) -> None:
        """Keep what was sensed with a view."""
        self._sensed[energy.stamp_ns] = energy
        while len(self._sensed) > MAX_KEPT:
            del self._sensed[min(self._sensed)]

    def has(self, stamp_ns: int) -> bool:
        """Whether the cycle of the view at `stamp_ns` waits for its energy no longer."""
        return not self._awaited or stamp_ns in self._sensed

    def needs(self, stamp_ns: int, cycle: int) -> list[Need]:
        """The needs at the view at `stamp_ns`: none of a body that senses none, or only later."""
        until_view = [known_ns for known_ns in self._sensed if known_ns <= stamp_ns]
        if not until_view:
            return []

        energy = self._sensed[max(until_view)]
        level = 1.0 - energy.level
        need = Need(
            id=need_id(ENERGY),
            label=ENERGY,
            activation=level,
            cycle=cycle,
            level=level,
            is_eased=energy.is_charging,
        )
        return [need]
