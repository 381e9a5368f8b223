"""What of a drive other tools show: senses, beliefs, sentences and the map, in order of time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.graph.window import Window
from cogmap.recording.log import Entry, Log
from cogmap.recording.storage.reader import Progress
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import PLAN_ID, ROOT_MAP, Need, Object, PathColumn, PlaceColumn, Plan
from cogmap.schemas.process import Health
from cogmap.schemas.sensing import Odometry, RangeScan, SelfMotion
from cogmap.schemas.topics import Topic

MAP_PERIOD_S = 1.0
"""How often the map is shown: all of it each time."""

OBJECT_HEIGHT_M = 3.0
OBJECT_WIDTH_M = 1.0
"""Of an object whose height, or width, is not known."""

PLACE_COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE)
OF_MIND = (topics.DELTA, topics.BROADCAST, topics.HEALTH, topics.TRUE_POSE)


class Sentence(NamedTuple):
    """What became conscious, or what the process `name` reports."""

    name: str
    text: str


@dataclass(frozen=True, eq=False)
class Map:
    """The map as it is now: the path and the plan, (n, 2) each, None without a route, the objects,
    and PLACE_COLUMNS of the place nodes, `cell_m` apart.
    """

    path_m: Floats
    plan_m: Floats | None
    objects: list[Object]
    places: Window
    cell_m: float

    @property
    def corner_m(self) -> tuple[float, float]:
        """Return the outer corner, x and y, of the first place node."""
        west, south = self.places.origin
        return (west - 0.5) * self.cell_m, (south - 0.5) * self.cell_m


class Moment(NamedTuple):
    """A message of a drive, a Self, a Need, a Sentence or the Map, as it was at `stamp_ns`.

    The stamp is on the clock of who received it, as if its first message had taken no time;
    `log_time_ns` is when it was received, `time_s` the same in seconds since the log's first
    message.
    """

    stamp_ns: int
    log_time_ns: int
    time_s: float
    content: Any


def moments(
    log: Log, senses: tuple[Topic, ...], progress: Progress | None = None
) -> Iterator[Moment]:
    """Yield what there is to show of the drive in `log`: the messages of `senses`, and what the
    agent believed, said and knew. Raises LogError if the log is damaged.
    """
    graph = Graph()
    drive = Drive(graph, lambda delta, _: graph.apply(delta))
    for entry in log.messages(*senses, *OF_MIND):
        yield from drive.shown(entry)
        if progress is not None:
            progress(entry.time_s / max(log.duration_s, 1e-9))
    yield from drive.end()


class Drive:
    """Follows a drive, message by message, from a log or as it happens.

    `graph` is its workspace's, which `follow` keeps: it takes a delta and the incarnation that
    published it.
    """

    def __init__(self, graph: Graph, follow: Callable[[Delta, int | None], object]) -> None:
        self._graph = graph
        self._follow = follow
        self._map_due_s = 0.0
        self._begin_ns: int | None = None
        self._entry: Entry
        self._stamp_ns = 0
        self._readers: dict[type[Message], Callable[[Any], Iterator[Moment]]] = {
            Delta: self._of_delta,
            Broadcast: self._of_broadcast,
            Health: self._of_health,
            SelfMotion: self._of_self_motion,
        }

    def shown(self, entry: Entry) -> Iterator[Moment]:
        """Yield what follows from a message."""
        self._entry = entry
        if self._begin_ns is None and not isinstance(entry.message, Health):
            self._begin_ns = entry.log_time_ns - entry.message.stamp_ns
        reader = self._readers.get(type(entry.message))
        yield from self._of_sense(entry.message) if reader is None else reader(entry.message)

        if entry.time_s >= self._map_due_s and self._graph.agent is not None:
            self._map_due_s = entry.time_s + MAP_PERIOD_S
            yield from self.end()

    def end(self) -> Iterator[Moment]:
        """Yield the map as it is now, once there is one."""
        agent = self._graph.agent
        if agent is not None:
            yield self._moment(agent.stamp_ns, map_of(self._graph))

    def _moment(self, stamp_ns: int, content: Any) -> Moment:
        self._stamp_ns = max(stamp_ns, 0)
        received = self._entry
        begin_ns = received.log_time_ns if self._begin_ns is None else self._begin_ns
        return Moment(begin_ns + self._stamp_ns, received.log_time_ns, received.time_s, content)

    def _of_sense(self, message: Message) -> Iterator[Moment]:
        yield self._moment(message.stamp_ns, message)

    def _of_self_motion(self, motion: SelfMotion) -> Iterator[Moment]:
        """Yield each motion between two views as odometry: the last one ends at the second."""
        rows = motion.motions.numpy()
        before_end_s = np.cumsum(rows[::-1, 2])[::-1] - rows[:, 2]
        for row, rest_s in zip(rows.tolist(), before_end_s.tolist(), strict=True):
            speed_m_s, turn_rate_rad_s, dt_s, *_ = row
            moved = Odometry(
                stamp_ns=max(0, motion.stamp_ns - round(rest_s * 1e9)),
                speed_m_s=speed_m_s,
                turn_rate_rad_s=turn_rate_rad_s,
                dt_s=dt_s,
            )
            yield self._moment(moved.stamp_ns, moved)

    def _of_delta(self, delta: Delta) -> Iterator[Moment]:
        before = self._graph.agent
        envelope = self._entry.envelope
        self._follow(delta, None if envelope is None else envelope.incarnation)
        agent = self._graph.agent
        if agent is not None and agent is not before:
            yield self._moment(agent.stamp_ns, agent)

        for changed in delta.operations:
            if isinstance(changed, Need):
                yield self._moment(delta.stamp_ns, changed)

    def _of_broadcast(self, broadcast: Broadcast) -> Iterator[Moment]:
        coalition = broadcast.coalition
        nodes = ", ".join(node.id for node in coalition.nodes)
        sentence = Sentence(coalition.codelet, f"conscious: {nodes}")
        yield self._moment(broadcast.stamp_ns, sentence)

    def _of_health(self, health: Health) -> Iterator[Moment]:
        for note in health.notes:
            yield self._moment(self._stamp_ns, Sentence(health.instance, note))


def map_of(graph: Graph) -> Map:
    """Return what a graph holds of the root map."""
    rows = rows_of(graph.path)
    plan = graph.get(Plan, PLAN_ID)
    plan_m = None
    if plan is not None and plan.route is not None and plan.map == ROOT_MAP:
        plan_m = plan.route.numpy().astype(np.float64)
    return Map(
        path_m=rows[:, [PathColumn.X_M, PathColumn.Y_M]],
        plan_m=plan_m,
        objects=[node for node in graph.of_kind(Object) if node.map == ROOT_MAP],
        places=graph.places.window(ROOT_MAP, PLACE_COLUMNS),
        cell_m=graph.cell_m(),
    )


def points_of(scan: RangeScan) -> Singles:
    """Return the points where a range scan met something, (n, 3) in the robot's frame, z 0."""
    bearing_rad = scan.bearing_rad.numpy().astype(np.float64)
    range_m = scan.range_m.numpy().astype(np.float64)
    met = range_m > 0
    points_m = np.zeros((int(met.sum()), 3), np.float32)
    points_m[:, 0] = range_m[met] * np.cos(bearing_rad[met])
    points_m[:, 1] = range_m[met] * np.sin(bearing_rad[met])
    return points_m
