"""Stands in for body and perception of a running system, and observes what it does."""

from __future__ import annotations

import numpy as np

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Bus
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Snapshot, SnapshotRequest
from cogmap.schemas.process import Clock, Health
from cogmap.schemas.sensing import MotorCommand, Percept, Percepts, SelfMotion
from tests.support.system.processes import wait_until

PERIOD_NS = 100_000_000
SPEED_M_S = 1.0
BUILDING_M = (60.0, 8.0)
ANSWER_TIMEOUT_S = 2.0


def _road() -> Array:
    """Ground points on a road straight ahead."""
    ahead_m = np.arange(2.0, 12.0)
    left_m = np.arange(-2.0, 3.0)
    grid_m = np.meshgrid(ahead_m, left_m)
    points_m = np.stack(grid_m, -1).reshape(-1, 2)
    return Array.of(points_m, "<f4")


class Feeder:
    """Drives straight on at SPEED_M_S past one building, with ten views a second.

    The building is seen so vaguely that the self node moves as the self-motion states.
    """

    def __init__(self, bus: Bus) -> None:
        self.stamps: list[int] = []
        self._last_ns = 0
        self._paused = False
        self._road_m = _road()
        emits = (topics.CLOCK, topics.SELF_MOTION, topics.PERCEPTS)
        self.shell = Shell(Module("feeder").every(PERIOD_NS // 2, self._on_timer, emits), bus)

    @property
    def views(self) -> int:
        """How many there have been."""
        return len(self.stamps)

    def driven_m(self, stamp_ns: int | None = None) -> float:
        """The distance driven so far, or at the view of `stamp_ns`."""
        views = self.views
        if stamp_ns is not None:
            views = self.stamps.index(stamp_ns) + 1

        driven_s = views * PERIOD_NS / 1e9
        return driven_s * SPEED_M_S

    def pause(self) -> None:
        """Let the clock continue and nothing move."""
        self._paused = True

    def _on_timer(self, now_ns: int) -> list[Message]:
        clock = Clock(stamp_ns=now_ns)
        if self._paused or now_ns - self._last_ns < PERIOD_NS:
            return [clock]

        frame = self.views
        motion = SelfMotion(
            stamp_ns=now_ns, frame=frame, since_ns=self._last_ns, motions=_motions()
        )
        self._last_ns = now_ns
        self.stamps.append(now_ns)
        percepts = Percepts(
            stamp_ns=now_ns, frame=frame, objects=[self._building()], road_m=self._road_m
        )
        return [clock, motion, percepts]

    def _building(self) -> Percept:
        x_m = BUILDING_M[0] - self.driven_m()
        y_m = BUILDING_M[1]
        return Percept(
            name="building-01",
            activation=0.9,
            evidence=0.9,
            bearing_rad=float(np.arctan2(y_m, x_m)),
            range_m=float(np.hypot(x_m, y_m)),
            bearing_sd_rad=0.5,
            range_sd_m=20.0,
            width_m=9.0,
            height_m=6.0,
            whole=True,
            box_px=(10, 10, 50, 50),
        )


def _motions() -> Array:
    """One period straight on: speed, turn rate, duration, standard deviations of both speeds."""
    row = [SPEED_M_S, 0.0, PERIOD_NS / 1e9, 1e-3, 1e-3]
    return Array.of([row], "<f8")


class Witness:
    """Follows the graph, and keeps what else it has received."""

    def __init__(self, bus: Bus, name: str = "witness") -> None:
        self.graph = Graph()
        self.deltas: list[Delta] = []
        self.commands: list[MotorCommand] = []
        self.health: dict[str, Health] = {}
        self.tasks_done: list[str] = []
        self._bus = bus
        module = Module("witness", name).following(self.graph, self._on_delta)
        module.on(topics.MOTOR_COMMAND, self.commands.append)
        module.on(topics.HEALTH, self._on_health)
        self.shell = Shell(module, bus)

    @property
    def versions(self) -> list[int]:
        return [delta.version for delta in self.deltas]

    def await_cycles(self, cycles: int) -> None:
        """Wait until so many cycles more have ended, each with a task done in it."""
        began = len(self.deltas)

        def are_enough() -> bool:
            later = self.deltas[began:]
            ended = {delta.cycle for delta in later if delta.tasks}
            return len(ended) >= cycles

        wait_until(are_enough, f"{cycles} cycles more")

    def await_same_graph(self) -> None:
        """Wait until the graph here is the workspace's. What feeds it must have paused."""

        def is_same() -> bool:
            here = self.graph.digest()
            return self._workspace_digest() == here

        wait_until(is_same, "the replica is the workspace's graph")

    def _on_delta(self, delta: Delta) -> None:
        self.deltas.append(delta)
        self.tasks_done += delta.tasks

    def _on_health(self, health: Health) -> None:
        self.health[health.instance] = health

    def _workspace_digest(self) -> str:
        request = encode(SnapshotRequest())
        try:
            answer = self._bus.query(topics.SNAPSHOT_REQUEST, request, ANSWER_TIMEOUT_S)
        except NoAnswerError:
            return ""
        snapshot = decode(topics.SNAPSHOT, answer.payload)
        assert isinstance(snapshot, Snapshot)
        graph = Graph()
        graph.load(snapshot)
        return graph.digest()
