"""Lanes: codelets that run beside the cycle, one task at a time each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from cogmap.runtime.codelet import ConfiguredCodelet, CycleContext
from cogmap.runtime.run import Run
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Proposal
from cogmap.schemas.graph import Phase
from cogmap.services.workspace.commit import Ledger
from cogmap.services.workspace.config import Config
from cogmap.services.workspace.tasks.dispatch import Dispatch

LEASE_NS = 5_000_000_000
"""In real time, how long a worker may take for a background task."""


class Lanes:
    """The lanes of all background codelets."""

    def __init__(self, codelets: Iterable[ConfiguredCodelet], config: Config, run: Run) -> None:
        self._lanes: list[Lane] = []
        for codelet in codelets:
            if codelet.codelet.phase is Phase.BACKGROUND:
                self._lanes.append(Lane(codelet, config, run, self.dispatches))

    def dispatches(self) -> list[Dispatch]:
        """Return the dispatch of each lane."""
        return [lane.dispatch for lane in self._lanes]

    def begin(self, context: CycleContext, ledger: Ledger, now_ns: int) -> list[Message]:
        """Begin a task in each lane if none runs there and one is due; return what to publish."""
        published: list[Message] = []
        for lane in self._lanes:
            published += lane.begin(context, ledger, now_ns)

        return published

    def answer(self, proposal: Proposal) -> bool:
        """Give a proposal to the lane whose task it answers; return whether there is one."""
        return any(dispatch.answer(proposal) for dispatch in self.dispatches())

    def presence(self, worker: str, is_alive: bool, version: int, now_ns: int) -> list[Message]:
        """Note that a worker came or went; return what is to be published."""
        published: list[Message] = []
        for dispatch in self.dispatches():
            dispatch.refresh(version)
            published += dispatch.presence(worker, is_alive, now_ns)

        return published

    def expire(self, version: int, now_ns: int) -> list[Message]:
        """Revoke leases that have ended; return what is to be published."""
        published: list[Message] = []
        for dispatch in self.dispatches():
            dispatch.refresh(version)
            published += dispatch.expire(now_ns)

        return published

    def collect(self, cycle: int) -> Iterator[tuple[list[Proposal], list[str]]]:
        """Yield, for each lane, the answer to commit at the end of `cycle`, and failed tasks."""
        for lane in self._lanes:
            yield lane.collect(cycle)


class Lane:
    """The lane of one background codelet; `lanes` are the dispatches of all.

    In lockstep its answer is committed at the end of a cycle that is set beforehand, so that a run
    depends on its seed alone.
    """

    def __init__(
        self,
        codelet: ConfiguredCodelet,
        config: Config,
        run: Run,
        lanes: Callable[[], list[Dispatch]],
    ) -> None:
        self.codelet = codelet
        self.dispatch = Dispatch(LEASE_NS, lanes)

        self._is_lockstep = run.lockstep
        self._cycles = config.background_cycles
        self._due_cycle = 0

    def begin(self, context: CycleContext, ledger: Ledger, now_ns: int) -> list[Message]:
        """Begin a task if none runs and one is due; return what is to be published."""
        if not self.dispatch.is_idle:
            return []

        tasks = self.codelet.due(context, ledger.graph)[:1]
        if not tasks:
            return []

        self._due_cycle = context.cycle + self._cycles
        return self.dispatch.begin(tasks, now_ns)

    def collect(self, cycle: int) -> tuple[list[Proposal], list[str]]:
        """Take the answer, if it is to be committed at the end of `cycle`, and failed tasks."""
        if self.dispatch.is_idle or not self.dispatch.complete:
            return [], []

        is_early = self._is_lockstep and cycle < self._due_cycle
        if is_early:
            return [], []

        failed = self.dispatch.failed
        answers, _ = self.dispatch.collect()
        return answers, failed
