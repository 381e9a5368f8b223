"""Messages to feed the modules of the mind with, and a workspace with workers at hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from cogmap.bus.codec import decode, encode
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from schemas import topics
from schemas.array import Array
from schemas.base import Message, Scalar
from schemas.cognition import Task
from schemas.graph import Delta, Node, Operation, Proposal
from schemas.process import Clock, Presence
from schemas.sensing import Percept, Percepts, SelfMotion
from services.codelets.module import Config as WorkerConfig
from services.codelets.module import build as build_worker
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


def node(
    identifier: str, samples: Rows | np.ndarray | None = None, kind: str = "object", **facts: Scalar
) -> Node:
    """A node with those attributes, fully active."""
    array = None if samples is None else Array.of(np.asarray(samples, np.float64))
    return Node(id=identifier, kind=kind, activation=1.0, attributes=facts, samples=array)


def task(codelet: str, *nodes: Node, identifier: str = "", **facts: object) -> Task:
    """A task for worker `w`."""
    usual = {
        "worker": "w",
        "attempt": 0,
        "cycle": 1,
        "base_version": 1,
        "cell_m": 1.0,
        "percepts": [],
    }
    empty = {
        "motions": Array.of(np.zeros((0, 5))),
        "road_m": Array.of(np.zeros((0, 2), np.float32)),
    }
    identifier = identifier or f"1/{codelet}"
    return Task(
        task_id=identifier, codelet=codelet, nodes=list(nodes), **{**usual, **empty, **facts}
    )  # type: ignore[arg-type]


def answer(
    asked: Task, operations: Iterable[Operation] = (), worker: str = "", failure: str = ""
) -> Proposal:
    """A proposal for `asked`."""
    return Proposal(
        stamp_ns=asked.stamp_ns,
        task_id=asked.task_id,
        worker=worker or asked.worker,
        codelet=asked.codelet,
        base_version=asked.base_version,
        operations=list(operations),
        failure=failure,
    )


class Desk:
    """A workspace that is fed by hand: every delta that it says is kept, and every task until it is
    taken.
    """

    def __init__(self, *workers: str, mode: str = "lockstep", **settings: object) -> None:
        self.module: Module = build(Config(mode=mode, **settings), "workspace")  # type: ignore[arg-type]
        self.deltas: list[Delta] = []
        self.tasks: list[Task] = []
        self._workers: dict[str, Module] = {}
        for worker in workers:
            self.presence(worker)

    def feed(self, message: Message) -> list[Message]:
        """Let the workspace take in `message`, as it would come off a bus."""
        said = self.module.feed(decode(topics.of(message), encode(message)))
        self.deltas += [item for item in said if isinstance(item, Delta)]
        self.tasks += [item for item in said if isinstance(item, Task)]
        return said

    def presence(self, worker: str, alive: bool = True) -> list[Message]:
        """A worker comes or goes."""
        return self.feed(
            Presence(module="codelets", instance=worker, alive=alive, observer="workspace")
        )

    def clock(self, now_ns: int) -> list[Message]:
        """Time goes on."""
        return self.feed(Clock(stamp_ns=now_ns))

    def see(self, frame: int, *objects: Percept, rows: Rows = STRAIGHT, road_m: Rows = ()) -> None:
        """A view and the motion up to it."""
        self.feed(motion(frame, rows))
        self.feed(percepts(frame, *objects, road_m=road_m))

    def take(self) -> list[Task]:
        """The tasks that were said since the last time."""
        tasks = self.tasks
        self.tasks = []
        return tasks

    def work(self, config: WorkerConfig | None = None) -> None:
        """Let real workers answer until nothing is asked any more."""
        while tasks := self.take():
            for asked in tasks:
                worker = self._workers.setdefault(
                    asked.worker, build_worker(config or WorkerConfig(), asked.worker)
                )
                for said in worker.feed(asked):
                    if isinstance(said, Proposal):
                        self.feed(said)

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
    def digest(self) -> str:
        """The digest of the workspace's own graph."""
        graph = Graph()
        reply, handler = self.module.served[topics.SNAPSHOT_REQUEST]
        graph.load(decode(reply, encode(handler(None))))  # type: ignore[arg-type]
        return graph.digest()
