"""A workspace with workers at hand, and our codelets run by hand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import msgspec

from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, ConfiguredCodelet
from cogmap.runtime.module import Module
from cogmap.runtime.run import LOCKSTEP, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Assignment, Leases, Proposal, Task
from cogmap.schemas.graph import Delta, Operation, Snapshot, SnapshotRequest
from cogmap.schemas.nodes import Node, Self
from cogmap.schemas.process import Clock, Presence
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.module import Config as WorkerConfig
from cogmap.services.codelets.module import build as build_worker
from cogmap.services.codelets.table import own_codelets
from cogmap.services.workspace.module import Config, build
from cogmap.testing import Rows, percepts, run_codelet, self_motion
from cogmap.testing.builders import STRAIGHT


def thing(name: str) -> Node:
    """A node of a kind that the table of kinds does not have."""
    return Node(id=name, kind="thing", activation=1.0)


def configured(config: WorkerConfig | None = None) -> list[ConfiguredCodelet]:
    """All our codelets: with these settings, where they are of their kind."""
    settings = config or WorkerConfig()
    return [ConfiguredCodelet(codelet, _settings(codelet, settings)) for codelet in own_codelets()]


def _settings(codelet: Codelet, settings: msgspec.Struct) -> msgspec.Struct:
    """`settings`, or a codelet's defaults where it has others."""
    return settings if codelet.config is type(settings) else codelet.config()


def run(asked: Task, graph: Graph, config: msgspec.Struct) -> Answer:
    """What the codelet of `asked` answers."""
    (codelet,) = (codelet for codelet in own_codelets() if codelet.name == asked.codelet)
    return run_codelet(codelet, asked, graph, _settings(codelet, config))


def answer(asked: Task, operations: Iterable[Operation] = (), failure: str = "") -> Proposal:
    """A proposal for `asked`."""
    return Proposal(
        stamp_ns=asked.stamp_ns,
        task_id=asked.task_id,
        codelet=asked.codelet,
        base_version=asked.version,
        operations=list(operations),
        failure=failure,
    )


def received(message: Message) -> Message:
    """`message` as it comes off a bus."""
    return decode(topics.of(message), encode(message))


class Desk:
    """A workspace that is fed by hand: every delta that it publishes is kept, and every task until
    it is taken.
    """

    def __init__(
        self,
        *workers: str,
        run: Run = LOCKSTEP,
        codelets: WorkerConfig | None = None,
        **settings: Any,
    ) -> None:
        self._configured = configured(codelets)
        config = Config(**settings)
        self.module: Module = build(config, "workspace", self._configured, run)
        self.withheld: list[Assignment] = []
        self.withhold = ""
        self.busy: list[str] = []
        self.deltas: list[Delta] = []
        self.tasks: list[Task] = []
        self.published: list[Message] = []
        self._leases: dict[str, Assignment] = {}
        self._workers: dict[str, Module] = {}
        self._unread: list[Message] = []
        for worker in workers:
            self.presence(worker)

    def feed(self, message: Message) -> list[Message]:
        """Let the workspace receive `message`, as it would come off a bus: an answer that has no
        source is of the worker that holds its task.
        """
        if isinstance(message, Proposal) and not message.source:
            lease = self._leases.get(message.task_id)
            worker = "" if lease is None else lease.worker
            message = msgspec.structs.replace(message, source=worker)
        published = self.module.feed(received(message))
        self.published += published
        self._unread += published
        for item in published:
            self._keep(item)
        return published

    def _keep(self, message: Message) -> None:
        match message:
            case Delta():
                self.deltas.append(message)
            case Task():
                self.tasks.append(message)
            case Leases():
                self._leases |= {lease.task_id: lease for lease in message.assignments}

    def lease(self, asked: Task) -> Assignment:
        """Which worker holds `asked`, as was published last."""
        return self._leases[asked.task_id]

    def presence(self, worker: str, alive: bool = True) -> list[Message]:
        """A worker comes or goes."""
        presence = Presence(module="codelets", instance=worker, alive=alive, observer="workspace")
        return self.feed(presence)

    def clock(self, now_ns: int) -> list[Message]:
        """The time is `now_ns`."""
        return self.feed(Clock(stamp_ns=now_ns))

    def see(self, frame: int, *objects: Percept, rows: Rows = STRAIGHT, road_m: Rows = ()) -> None:
        """A view and the motion up to it."""
        self.feed(self_motion(frame, rows))
        self.feed(percepts(frame, *objects, road_m=road_m))

    def take(self) -> list[Task]:
        """The tasks that were published since the last time."""
        tasks = self.tasks
        self.tasks = []
        return tasks

    def work(self) -> None:
        """Let real workers answer until nothing is asked any more."""
        while self._unread:
            message = self._unread.pop(0)
            if isinstance(message, Leases):
                message = self._kept_back(message)
                for lease in message.assignments:
                    self._employ(lease.worker)
                    self.busy.append(lease.worker)
            self._show_all(message)
        self.tasks = []

    def drive(
        self, frames: range, *objects: Percept, road_m: Rows = ((2.0, 0.0), (3.0, 0.5))
    ) -> None:
        """Views of the same objects, each answered by real workers."""
        for frame in frames:
            self.see(frame, *objects, road_m=road_m)
            self.work()

    @property
    def graph(self) -> Graph:
        """A copy of the graph, as a replica that follows all deltas has it."""
        graph = Graph()
        for delta in self.deltas:
            assert graph.apply(delta)
        return graph

    @property
    def agent(self) -> Self:
        """The self node of the graph."""
        found = self.graph.agent
        assert found is not None
        return found

    @property
    def digest(self) -> str:
        """The digest of the workspace's own graph."""
        graph = Graph()
        graph.load(self._snapshot())
        return graph.digest()

    def release(self) -> None:
        """Let the workers do what was withheld: the tasks of codelet `withhold`."""
        leases = Leases(assignments=self.withheld)
        self.withheld = []
        self._show_all(leases)

    def _snapshot(self) -> Snapshot:
        _, handler = self.module.served[topics.SNAPSHOT_REQUEST]
        snapshot = received(handler(SnapshotRequest()))
        assert isinstance(snapshot, Snapshot)
        return snapshot

    def _kept_back(self, leases: Leases) -> Leases:
        shown = []
        for lease in leases.assignments:
            if self.withhold and f"/{self.withhold}" in lease.task_id:
                self.withheld.append(lease)
            else:
                shown.append(lease)
        return msgspec.structs.replace(leases, assignments=shown)

    def _employ(self, name: str) -> None:
        """A worker joins, with the graph as it is and the tasks that were published."""
        if name in self._workers:
            return
        worker = build_worker(name, self._configured)
        assert worker.graph is not None
        worker.graph.load(self._snapshot())
        self._workers[name] = worker
        for message in self.published:
            if isinstance(message, Task):
                self._show(worker, message)

    def _show_all(self, message: Message) -> None:
        for worker in list(self._workers.values()):
            self._show(worker, message)

    def _show(self, worker: Module, message: Message) -> None:
        if topics.of(message) not in worker.handlers:
            return
        for published in worker.feed(received(message)):
            self.feed(published)
