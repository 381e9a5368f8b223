"""Map correction beside the cycle: it may take several, and its answer is committed at the end of
one.
"""

from __future__ import annotations

from schemas.cognition import Task
from schemas.graph import Proposal
from services.workspace.config import Config
from services.workspace.dispatch import Dispatch


class Correction:
    """The one correction that is being computed, if any.

    In lockstep its answer is committed at the end of a cycle that is set beforehand, whenever it
    comes.
    """

    def __init__(self, config: Config) -> None:
        self._lockstep = config.mode == "lockstep"
        self._cycles = config.correction_cycles
        self.dispatch = Dispatch(int(config.correction_lease_ms * 1e6), config.attempts)
        self._due_cycle: int | None = None

    @property
    def runs(self) -> bool:
        """Whether one has begun whose answer is not committed yet."""
        return self._due_cycle is not None

    def begin(self, tasks: list[Task], cycle: int, now_ns: int) -> list[Task]:
        """Take on a correction; the tasks to be sent now."""
        if not tasks:
            return []
        self._due_cycle = cycle + self._cycles
        return self.dispatch.begin(tasks, now_ns)

    def holds_up(self, cycle: int) -> bool:
        """Whether `cycle` cannot end before it is answered."""
        due = self._due_cycle is not None and cycle >= self._due_cycle
        return self._lockstep and due and not self.dispatch.complete

    def collect(self, cycle: int) -> tuple[list[Proposal], list[str]]:
        """Its answer, where it is to be committed at the end of `cycle`, and the tasks that were
        given up.
        """
        if (
            self._due_cycle is None
            or not self.dispatch.complete
            or (self._lockstep and cycle < self._due_cycle)
        ):
            return [], []
        self._due_cycle = None
        failed = self.dispatch.failed
        return self.dispatch.collect()[0], failed
