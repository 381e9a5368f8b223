"""Messages to feed the modules of the mind with, and a workspace with workers at hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt

from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, ConfiguredCodelet
from cogmap.runtime.module import Module
from schemas import topics
from schemas.array import Array, Matrix
from schemas.base import Message
from schemas.codelets import Assignment, Leases, Proposal, Task
from schemas.graph import Delta, Operation, Phase, SnapshotRequest
from schemas.nodes import ROOT_MAP, SELF_ID, Map, Node, Object, Self, object_id
from schemas.process import Clock, Presence
from schemas.sensing import Percept, Percepts, SelfMotion
from services.codelets.module import Config as WorkerConfig
from services.codelets.module import build as build_worker
from services.codelets.table import CODELETS
from services.workspace.module import Config, build

PERIOD_NS = 200_000_000
Rows = Sequence[Sequence[float]]
STRAIGHT: Rows = ((2.0, 0.0, 0.2, 0.1, 0.01),)


def stamp_ns(frame: int) -> int:
    """When a view was sensed; the first one is number 0."""
    return (frame + 1) * PERIOD_NS


def motion(frame: int, rows: Rows = STRAIGHT) -> SelfMotion:
    """The self-motion from the view before to view `frame`."""
    motions = Array.of(np.array(rows, np.float64).reshape(-1, 5))
    return SelfMotion(
        stamp_ns=stamp_ns(frame), frame=frame, since_ns=stamp_ns(frame - 1), motions=motions
    )


def percept(
    label: str = "house", bearing_rad: float = 0.0, range_m: float = 10.0, **facts: object
) -> Percept:
    """One building, seen well."""
    usual = {
        "activation": 0.9,
        "bearing_sd_rad": 0.02,
        "range_sd_m": 0.3,
        "width_m": 8.0,
        "height_m": 6.0,
    }
    more = {"whole": True, "box_px": (0, 0, 10, 10)}
    return Percept(
        label=label, bearing_rad=bearing_rad, range_m=range_m, **{**usual, **more, **facts}
    )  # type: ignore[arg-type]


def percepts(frame: int, *objects: Percept, road_m: Rows = ()) -> Percepts:
    """What was recognised in view `frame`."""
    road = Array.of(np.array(road_m, np.float32).reshape(-1, 2))
    return Percepts(stamp_ns=stamp_ns(frame), frame=frame, objects=list(objects), road_m=road)


def agent(samples: npt.ArrayLike | None = None, **facts: Any) -> Self:
    """The self node, fully active, at the origin unless `facts` have another pose."""
    values = np.zeros((200, 3)) if samples is None else samples
    return Self(id=SELF_ID, activation=1.0, base_level=1.0, samples=Matrix.of(values), **facts)


def landmark(
    label: str = "house", samples_m: npt.ArrayLike = ((10.0, 0.0),), **facts: Any
) -> Object:
    """An object with those samples of its position, fully active."""
    values = np.asarray(samples_m, np.float64)
    mean_m = values.mean(axis=0)
    usual = {"activation": 1.0, "x_m": float(mean_m[0]), "y_m": float(mean_m[1])}
    return Object(
        id=object_id(label),
        label=label,
        offsets_m=Matrix.of(values - mean_m, "<f2"),
        **{**usual, **facts},
    )


def thing(name: str) -> Node:
    """A node of a kind that the table of kinds does not have."""
    return Node(id=name, kind="thing", activation=1.0)


def graph_of(*operations: Operation, cell_m: float = 1.0) -> Graph:
    """A graph at version 1, in cycle 1, of a root map and what `operations` make."""
    graph = Graph()
    written = [Map(id=ROOT_MAP, cell_m=cell_m), *operations]
    assert graph.apply(Delta(version=1, cycle=1, phase=Phase.PERCEPTS, operations=written))
    return graph


def task(codelet: str, identifier: str = "", **facts: Any) -> Task:
    """A task of cycle 1 on version 1."""
    usual = {
        "cycle": 1,
        "version": 1,
        "motions": Array.of(np.zeros((0, 5))),
        "road_m": Array.of(np.zeros((0, 2), np.float32)),
    }
    name = identifier or f"1/{codelet}"
    return Task(task_id=name, codelet=codelet, **{**usual, **facts})


def configured(config: WorkerConfig | None = None) -> list[ConfiguredCodelet]:
    """All our codelets, with these settings."""
    return [ConfiguredCodelet(codelet, config or WorkerConfig()) for codelet in CODELETS]


def run(asked: Task, graph: Graph, config: WorkerConfig) -> Answer:
    """What the codelet of `asked` answers."""
    (codelet,) = [codelet for codelet in CODELETS if codelet.name == asked.codelet]
    return codelet.run(asked, graph, config)


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


class Desk:
    """A workspace that is fed by hand: every delta that it publishes is kept, and every task until
    it is taken.
    """

    def __init__(
        self,
        *workers: str,
        mode: str = "lockstep",
        codelets: WorkerConfig | None = None,
        **settings: Any,
    ) -> None:
        self._configured = configured(codelets)
        config = Config(mode=mode, **settings)  # type: ignore[arg-type]
        self.module: Module = build(config, "workspace", self._configured)
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
        """Let the workspace receive `message`, as it would come off a bus."""
        published = self.module.feed(decode(topics.of(message), encode(message)))
        self.published += published
        self._unread += published
        for item in published:
            if isinstance(item, Delta):
                self.deltas.append(item)
            elif isinstance(item, Task):
                self.tasks.append(item)
            elif isinstance(item, Leases):
                self._leases |= {lease.task_id: lease for lease in item.assignments}
        return published

    def lease(self, asked: Task) -> Assignment:
        """Which worker holds `asked`, as was published last."""
        return self._leases[asked.task_id]

    def presence(self, worker: str, alive: bool = True) -> list[Message]:
        """A worker comes or goes."""
        return self.feed(
            Presence(module="codelets", instance=worker, alive=alive, observer="workspace")
        )

    def clock(self, now_ns: int) -> list[Message]:
        """The time is `now_ns`."""
        return self.feed(Clock(stamp_ns=now_ns))

    def see(self, frame: int, *objects: Percept, rows: Rows = STRAIGHT, road_m: Rows = ()) -> None:
        """A view and the motion up to it."""
        self.feed(motion(frame, rows))
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
            for worker in list(self._workers.values()):
                self._show(worker, message)
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
        reply, handler = self.module.served[topics.SNAPSHOT_REQUEST]
        graph.load(decode(reply, encode(handler(SnapshotRequest()))))  # type: ignore[arg-type]
        return graph.digest()

    def release(self) -> None:
        """Let the workers do what was withheld: the tasks of codelet `withhold`."""
        leases = Leases(assignments=self.withheld)
        self.withheld = []
        for worker in list(self._workers.values()):
            self._show(worker, leases)

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
        _, handler = self.module.served[topics.SNAPSHOT_REQUEST]
        worker.graph.load(decode(topics.SNAPSHOT, encode(handler(SnapshotRequest()))))  # type: ignore[arg-type]
        self._workers[name] = worker
        for message in self.published:
            if isinstance(message, Task):
                self._show(worker, message)

    def _show(self, worker: Module, message: Message) -> None:
        if topics.of(message) not in worker.handlers:
            return
        for said in worker.feed(decode(topics.of(message), encode(message))):
            self.feed(said)
