"""Lanes: codelets that run beside the cycle, one task at a time each."""

from __future__ import annotations

from collections.abc import Callable

from cogmap.runtime.codelet import ConfiguredCodelet, CycleContext
from schemas.base import Message
from schemas.codelets import Proposal
from services.workspace.commit import Ledger
from services.workspace.config import Config
from services.workspace.dispatch import Dispatch


class Lane:
    """The lane of one background codelet; `lanes` are the dispatches of all.

    In lockstep its answer is committed at the end of a cycle that is set beforehand, so that a run
    depends on its seed alone.
    """

    def __init__(
        self,
        codelet: ConfiguredCodelet,
        config: Config,
        lanes: Callable[[], list[Dispatch]],
    ) -> None:
        self.codelet = codelet
        lease_ns = int(config.background_lease_ms * 1e6)
        self.dispatch = Dispatch(lease_ns, config.attempts, lanes)

        self._is_lockstep = config.mode == "lockstep"
        self._cycles = config.background_cycles
        self._due_cycle = 0

    def begin(self, context: CycleContext, ledger: Ledger, now_ns: int) -> list[Message]:
        """Begin a task where none runs and one is due; what is to be published."""
        if not self.dispatch.is_idle:
            return []

        tasks = self.codelet.due(context, ledger.graph)[:1]
        if not tasks:
            return []

        self._due_cycle = context.cycle + self._cycles
        return self.dispatch.begin(tasks, now_ns)

    def collect(self, cycle: int) -> tuple[list[Proposal], list[str]]:
        """The answer, where it is to be committed at the end of `cycle`, and tasks that failed."""
        if self.dispatch.is_idle or not self.dispatch.complete:
            return [], []

        is_early = self._is_lockstep and cycle < self._due_cycle
        if is_early:
            return [], []

        failed = self.dispatch.failed
        answers, _ = self.dispatch.collect()
        return answers, failed
