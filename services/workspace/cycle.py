"""The cognitive cycle in the workspace: percepts in, codelets' proposals collected, deltas out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.errors import MessageError
from schemas.array import Array
from schemas.base import Message
from schemas.cognition import Task
from schemas.graph import Delta, Operation, Proposal, Snapshot, SnapshotRequest
from schemas.process import Clock, Presence
from schemas.sensing import Percepts, SelfMotion
from services.workspace.commit import Ledger
from services.workspace.config import Config
from services.workspace.context import SELF, Scene
from services.workspace.correction import Correction
from services.workspace.decay import fade
from services.workspace.dispatch import Dispatch
from services.workspace.loop_closure import correction_tasks, revisit_tasks
from services.workspace.triggers import (
    PHASES,
    first_self,
    percept_operations,
    recognised,
    tasks_for,
)

WORKERS = "codelets"


class Workspace:
    """One cycle for each view: a state machine that messages drive. It is the only writer of its
    graph.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._ledger = Ledger(config.cell_m)
        self._correction = Correction(config)
        self._dispatch = Dispatch(
            int(config.lease_ms * 1e6), config.attempts, self._correction.dispatch
        )
        self._motions: list[SelfMotion] = []
        self._waiting: Percepts | None = None
        self._scene: Scene | None = None
        self._phase = 0
        self._late: dict[str, None] = {}
        self._now_ns = 0
        self._begun_ns = -1

    def restore(self, past: Iterable[Message]) -> None:
        """Take up the graph where it was left."""
        for message in past:
            if isinstance(message, Snapshot | Delta):
                self._ledger.restore(message)
                self._begun_ns = max(self._begun_ns, message.stamp_ns)

    def snapshot(self, request: SnapshotRequest | None = None) -> Snapshot:
        """The whole graph. Raises MessageError where `request` wants a version that is not
        committed yet.
        """
        graph = self._ledger.graph
        if request is not None and request.at_least > graph.version:
            raise MessageError(
                f"version {request.at_least} is not committed yet: the graph is at {graph.version}"
            )
        return graph.snapshot()

    def on_motion(self, motion: SelfMotion) -> list[Message]:
        """Keep what moved until a cycle moves the self node by it."""
        if (
            motion.motions.dtype != "<f8"
            or len(motion.motions.shape) != 2
            or motion.motions.shape[1] != 5
        ):
            raise MessageError(
                f"self-motion of shape {motion.motions.shape} and dtype {motion.motions.dtype}"
            )
        if motion.stamp_ns > self._moved_until_ns:
            self._motions.append(motion)
        return self._begin()

    def on_percepts(self, percepts: Percepts) -> list[Message]:
        """Start a cycle with the view's percepts, as soon as the one before has ended."""
        if len(percepts.road_m.shape) != 2 or percepts.road_m.shape[1] != 2:
            raise MessageError(f"road points of shape {percepts.road_m.shape}")
        if percepts.stamp_ns <= self._begun_ns:
            return []
        self._waiting = recognised(percepts, self._config.recognition_threshold)
        return self._begin()

    def on_proposal(self, proposal: Proposal) -> list[Message]:
        """Collect an answer. One that comes after its cycle has ended is committed now if it still
        applies.

        Where it does not, it is dropped, and the next delta counts it.
        """
        if self._dispatch.answer(proposal):
            return self._go_on_if_complete([])
        if self._correction.dispatch.answer(proposal):
            return self._end() if self._scene is not None and self._phase == len(PHASES) else []
        if proposal.task_id not in self._late:
            return []
        del self._late[proposal.task_id]
        operations, tasks = self._ledger.judge([proposal])
        if not tasks:
            return []
        cycle = self._ledger.graph.cycle
        return [self._ledger.commit(proposal.stamp_ns, cycle, "late", operations, tasks)]

    def on_presence(self, presence: Presence) -> list[Message]:
        """A worker came or went; the cycle goes on without a task that too many have been lost
        with.
        """
        if presence.module != WORKERS:
            return []
        worker = presence.instance
        alive = presence.alive
        tasks = self._correction.dispatch.presence(worker, alive, self._now_ns)
        tasks += self._dispatch.presence(worker, alive, self._now_ns)
        return self._go_on_if_complete(tasks)

    def on_clock(self, clock: Clock) -> list[Message]:
        """In real time, take back what a lease has ended for, and end a cycle at its deadline.

        The newest word holds: after a clock that ran far ahead, once, no later deadline would be
        kept.
        """
        self._now_ns = clock.stamp_ns
        if self._config.mode == "lockstep":
            return []
        tasks = self._correction.dispatch.expire(self._now_ns)
        if self._scene is None:
            return [*tasks]
        if self._now_ns > self._scene.percepts.stamp_ns + self._config.deadline_ms * 1e6:
            return [*tasks, *self._end_at_deadline()]
        return self._go_on_if_complete(tasks + self._dispatch.expire(self._now_ns))

    @property
    def _moved_until_ns(self) -> int:
        node = self._ledger.graph.nodes.get(SELF)
        return -1 if node is None else int(node.attributes["stamp_ns"])

    def _begin(self) -> list[Message]:
        """Begin a cycle if none runs, a view waits, and the self-motion up to it has come."""
        percepts = self._waiting
        if self._scene is not None or percepts is None:
            return []
        if not self._motions or self._motions[-1].stamp_ns < percepts.stamp_ns:
            return []
        self._waiting = None
        self._begun_ns = percepts.stamp_ns
        graph = self._ledger.graph
        self._scene = Scene(graph.cycle + 1, percepts, self._motions_until(percepts.stamp_ns))
        self._phase = -1
        operations: list[Operation] = (
            [] if SELF in graph.nodes else [first_self(self._config.first_samples)]
        )
        operations += percept_operations(graph, percepts)
        return [self._commit("percepts", operations), *self._next_phase()]

    def _motions_until(self, stamp_ns: int) -> Array:
        """Rows of self-motion since the self node was moved last, up to `stamp_ns`."""
        moved_ns = self._moved_until_ns
        rows = [
            motion.motions.numpy()
            for motion in self._motions
            if motion.since_ns >= moved_ns and motion.stamp_ns <= stamp_ns
        ]
        return Array.of(np.vstack(rows) if rows else np.zeros((0, 5)), "<f8")

    def _commit(
        self, phase: str, operations: list[Operation], tasks: list[str] | None = None
    ) -> Delta:
        if self._scene is None:
            raise MessageError("nothing is committed between cycles")
        return self._ledger.commit(
            self._scene.percepts.stamp_ns, self._scene.cycle, phase, operations, tasks
        )

    def _next_phase(self) -> list[Message]:
        """Dispatch the next phase's tasks; after the last, let activation fade and end the cycle."""
        self._phase += 1
        if self._scene is None or self._phase == len(PHASES):
            return self._end()
        graph = self._ledger.graph
        now_ns = self._now_ns
        tasks = tasks_for(PHASES[self._phase], self._scene, graph, self._config.path_spacing_m)
        sent: list[Message] = []
        if PHASES[self._phase] == "objects":
            tasks += revisit_tasks(self._scene, graph, self._config)
            loops = (
                [] if self._correction.runs else correction_tasks(self._scene, graph, self._config)
            )
            sent += self._correction.begin(loops, self._scene.cycle, now_ns)
        sent += self._dispatch.begin(tasks, now_ns)
        return sent if tasks else [*sent, *self._next_phase()]

    def _go_on_if_complete(self, tasks: list[Task]) -> list[Message]:
        """`tasks` to be sent, or the next phase where nothing is left to wait for in this one."""
        if self._scene is None or not self._dispatch.complete:
            return [*tasks]
        if self._phase == len(PHASES):
            return [*tasks, *self._end()]
        return [*tasks, *self._commit_answers(), *self._next_phase()]

    def _commit_answers(self) -> list[Message]:
        for name in self._dispatch.failed:
            self._ledger.drop(
                f"task {name} was given to {self._config.attempts} workers and lost each time"
            )
        answers, unanswered = self._dispatch.collect()
        self._late |= {task.task_id: None for task in unanswered}
        while len(self._late) > 256:
            del self._late[next(iter(self._late))]
        operations, tasks = self._ledger.judge(answers)
        return [self._commit(PHASES[self._phase], operations, tasks)] if operations else []

    def _end_at_deadline(self) -> list[Message]:
        """Commit what has come; the rest may still come in the next cycle."""
        return [*self._commit_answers(), *self._end()]

    def _end(self) -> list[Message]:
        """Let activation fade and begin the next cycle, unless a correction of the map is to be
        waited for.
        """
        if self._scene is None or self._correction.holds_up(self._scene.cycle):
            return []
        said: list[Message] = [*self._commit_correction(self._scene.cycle)]
        said.append(self._commit("decay", fade(self._ledger.graph, self._config)))
        self._motions = [
            motion for motion in self._motions if motion.stamp_ns > self._moved_until_ns
        ]
        self._scene = None
        return [*said, *self._begin()]

    def _commit_correction(self, cycle: int) -> list[Delta]:
        answers, failed = self._correction.collect(cycle)
        for name in failed:
            self._ledger.drop(
                f"task {name} was given to {self._config.attempts} workers and lost each time"
            )
        operations, tasks = self._ledger.judge(answers)
        return [self._commit("correction", operations, tasks)] if operations else []
