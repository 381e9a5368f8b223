"""A worker: it runs the tasks that the workspace leases to it, on its replica of the graph."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cogmap.errors import MessageError
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, ConfiguredCodelet
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.codelets import Assignment, Leases, Proposal, Task
from cogmap.schemas.graph import Delta
from cogmap.services.codelets.config import Config

__all__ = ["Config", "Worker", "build"]

# A bound on tasks and leases that wait: others do most of them, and deltas drop what is done.
MAX_WAITING = 1024


class Worker:
    """Runs the codelets of the tasks that are leased to it.

    A task begins once it has come, its lease has come, and the graph has reached its version. The
    proposal names the version that was read.
    """

    def __init__(self, instance: str, graph: Graph, codelets: Iterable[ConfiguredCodelet]) -> None:
        self._instance = instance
        self._graph = graph
        self._codelets = {codelet.name: codelet for codelet in codelets}

        self._tasks: dict[str, Task] = {}
        self._leases: dict[str, Assignment] = {}

    def on_task(self, task: Task) -> list[Proposal]:
        """Keep a task until it is leased, or the graph has reached its version."""
        self._tasks.pop(task.task_id, None)
        self._tasks[task.task_id] = task
        _limit(self._tasks)

        return self._run_ready()

    def on_leases(self, leases: Leases) -> list[Proposal]:
        """Take up the leases of this worker; a task that another holds now is not done here."""
        for assignment in leases.assignments:
            if assignment.worker == self._instance:
                self._leases[assignment.task_id] = assignment
            else:
                self._leases.pop(assignment.task_id, None)

        _limit(self._leases)
        return self._run_ready()

    def on_delta(self, delta: Delta) -> list[Proposal]:
        """Begin what waited for that version of the graph."""
        for name in delta.tasks:
            self._tasks.pop(name, None)
            self._leases.pop(name, None)

        return self._run_ready()

    def on_load(self) -> list[Proposal]:
        """Begin what waited for the graph."""
        return self._run_ready()

    def _run_ready(self) -> list[Proposal]:
        proposals = []
        for name, lease in list(self._leases.items()):
            task = self._tasks.get(name)
            if task is None or task.version != lease.version:
                continue

            if self._graph.version >= task.version:
                del self._leases[name]
                del self._tasks[name]
                proposals.append(self._run(task))

        return proposals

    def _run(self, task: Task) -> Proposal:
        """Return the proposal for a task; a failure is part of it."""
        answer = Answer()
        failure = ""
        try:
            codelet = self._codelets.get(task.codelet)
            if codelet is None:
                there_are = ", ".join(self._codelets)
                raise MessageError(f"no codelet {task.codelet}: there are {there_are}")
            answer = codelet.run(task, self._graph)
        except MessageError as error:
            failure = f"{task.codelet}: {error}"
        except Exception as error:  # another package's codelet may raise anything: it is named here
            failure = f"{task.codelet}: {type(error).__name__}: {error}"

        return Proposal(
            stamp_ns=task.stamp_ns,
            task_id=task.task_id,
            codelet=task.codelet,
            base_version=self._graph.version,
            operations=answer.operations,
            coalitions=answer.coalitions,
            events=answer.events,
            failure=failure,
        )


def _limit(waiting: dict[str, Any]) -> None:
    """Leave out the oldest of more than MAX_WAITING."""
    while len(waiting) > MAX_WAITING:
        oldest = next(iter(waiting))
        del waiting[oldest]


def build(instance: str, codelets: Iterable[ConfiguredCodelet]) -> Module:
    """Build one worker of the module `codelets`."""
    graph = Graph()
    worker = Worker(instance, graph, codelets)

    published = (topics.PROPOSAL,)
    return (
        Module("codelets", instance)
        .following(graph, worker.on_delta, emits=published, on_load=worker.on_load)
        .on(topics.TASK, worker.on_task, emits=published)
        .on(topics.LEASES, worker.on_leases, emits=published)
    )
