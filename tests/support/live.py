"""A mind on real processes and real Zenoh, fed at a steady pace without a simulator, and what looks
on.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cogmap.bus.codec import decode, encode
from cogmap.bus.session import free_endpoint
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.errors import NoAnswerError
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from schemas import topics
from schemas.array import Array
from schemas.base import Message
from schemas.graph import Delta, Snapshot, SnapshotRequest
from schemas.process import Clock, Health
from schemas.sensing import MotorCommand, Percept, Percepts, SelfMotion

TIMEOUT_S = 40.0
POOLS = ("sem.mp-", "sem.loky-", "joblib_")
AGENT = "fault"
PERIOD_NS = 100_000_000
SPEED_M_S = 1.0


def wait_until(condition: Callable[[], bool], what: str) -> None:
    """Look every 20 ms whether `condition` holds."""
    deadline_s = time.monotonic() + TIMEOUT_S
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline_s, f"it never happened: {what}"
        pause.wait(0.02)


def shared_memory() -> set[Path]:
    """Files in shared memory, but for those of pools of processes, which no module uses."""
    return {path for path in Path("/dev/shm").iterdir() if not path.name.startswith(POOLS)}


class Process:
    """A `cogmap` process with a pipe that ends it with this one."""

    def __init__(self, name: str, log: Path, *arguments: str) -> None:
        self.name = name
        self._log = log
        with log.open("ab") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "cli.main", *arguments],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=output,
            )
        self.pid = self._process.pid

    def said(self) -> list[str]:
        """The lines of its log, also those of processes of the same name before it."""
        return self._log.read_text().splitlines()

    def send(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def memory_mb(self) -> float:
        """Its resident memory."""
        return int(Path(f"/proc/{self.pid}/statm").read_text().split()[1]) * 4096 / 1e6

    def end(self, how: signal.Signals) -> int:
        """Send `how`, wait, and return the exit code."""
        self.send(how)
        self.send(signal.SIGCONT)
        with self._process as process:
            return process.wait(TIMEOUT_S)

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    @property
    def exit_code(self) -> int | None:
        """What it ended with; None while it is alive."""
        return self._process.poll()


class System:
    """Processes that meet at one endpoint."""

    def __init__(self, folder: Path) -> None:
        self.endpoint = free_endpoint()
        self.folder = folder
        self.processes: dict[str, Process] = {}

    def bus(self) -> ZenohBus:
        """A connection of this test's own."""
        return ZenohBus(self.endpoint, AGENT)

    def router(self) -> Process:
        """Start the router, or start it again."""
        return self._start_and_await("router", "router listens", "router")

    def modules(self, *instances: str, settings: tuple[str, ...] = ()) -> list[Process]:
        """Start modules, named after their instances such as `codelets-1`, and wait until all are
        ready.
        """
        options = ["--agent", AGENT, "--state", str(self.folder / "state")]
        options += [word for setting in settings for word in ("--set", setting)]
        started = {
            instance: self.start(
                instance, "module", instance.partition("-")[0], "--instance", instance, *options
            )
            for instance in instances
        }
        for instance, before in started.items():
            self._await(instance, f"{instance} is ready", before)
        return [self.processes[instance] for instance in instances]

    def start(self, name: str, *arguments: str) -> int:
        """Start `cogmap` with these arguments; how many lines those of that name said before it."""
        log = self.folder / f"{name}.log"
        before = len(log.read_text().splitlines()) if log.exists() else 0
        self.processes[name] = Process(name, log, *arguments, "--tied", "--connect", self.endpoint)
        return before

    def _start_and_await(self, name: str, sentence: str, *arguments: str) -> Process:
        self._await(name, sentence, self.start(name, *arguments))
        return self.processes[name]

    def _await(self, name: str, sentence: str, before: int) -> None:
        process = self.processes[name]

        def ready() -> bool:
            assert process.is_alive, process.said()
            return any(sentence in line for line in process.said()[before:])

        wait_until(ready, f"{name} says {sentence!r}")

    def close(self) -> None:
        """End everything, modules first."""
        for name in sorted(self.processes, key=lambda name: name == "router"):
            if self.processes[name].is_alive:
                self.processes[name].end(signal.SIGTERM)


class Feeder:
    """Stands in for body and perception: straight on at SPEED_M_S past one building, ten views a
    second.

    The building is seen so vaguely that the self node moves as the self-motion says.
    """

    def __init__(self, bus: ZenohBus) -> None:
        self.stamps: list[int] = []
        self._last_ns = 0
        self._paused = False
        says = (topics.CLOCK, topics.SELF_MOTION, topics.PERCEPTS)
        self.shell = Shell(Module("feeder").every(PERIOD_NS // 2, self._say, emits=says), bus)

    @property
    def views(self) -> int:
        """How many there have been."""
        return len(self.stamps)

    def driven_m(self, stamp_ns: int | None = None) -> float:
        """How far it has gone, or had at the view of `stamp_ns`."""
        views = self.views if stamp_ns is None else self.stamps.index(stamp_ns) + 1
        return views * PERIOD_NS / 1e9 * SPEED_M_S

    def pause(self) -> None:
        """Let the clock go on and nothing move."""
        self._paused = True

    def _say(self, now_ns: int) -> list[Message]:
        clock = Clock(stamp_ns=now_ns)
        if self._paused or now_ns - self._last_ns < PERIOD_NS:
            return [clock]
        since_ns = self._last_ns
        self._last_ns = now_ns
        row = [[SPEED_M_S, 0.0, PERIOD_NS / 1e9, 1e-3, 1e-3]]
        motion = SelfMotion(
            stamp_ns=now_ns, frame=self.views, since_ns=since_ns, motions=Array.of(row, "<f8")
        )
        self.stamps.append(now_ns)
        return [
            clock,
            motion,
            Percepts(stamp_ns=now_ns, frame=self.views, objects=self._seen(), road_m=_ROAD),
        ]

    def _seen(self) -> list[Percept]:
        x_m = 60.0 - self.driven_m()
        y_m = 8.0
        return [
            Percept(
                label="building-01",
                activation=0.9,
                bearing_rad=float(np.arctan2(y_m, x_m)),
                range_m=float(np.hypot(x_m, y_m)),
                bearing_sd_rad=0.5,
                range_sd_m=20.0,
                width_m=9.0,
                height_m=6.0,
                whole=True,
                box_px=(10, 10, 50, 50),
            )
        ]


_ROAD = Array.of(
    np.stack(np.meshgrid(np.arange(2.0, 12.0), np.arange(-2.0, 3.0)), -1).reshape(-1, 2), "<f4"
)


class Witness:
    """Follows the graph, and keeps what else it has seen."""

    def __init__(self, bus: ZenohBus) -> None:
        self.graph = Graph()
        self.deltas: list[Delta] = []
        self.commands: list[MotorCommand] = []
        self.health: dict[str, Health] = {}
        self.tasks_done: list[str] = []
        self._bus = bus
        module = (
            Module("witness")
            .following(self.graph, self._keep_delta)
            .on(topics.MOTOR_COMMAND, self.commands.append)
        )
        self.shell = Shell(module.on(topics.HEALTH, self._keep), bus)

    def _keep_delta(self, delta: Delta) -> None:
        self.deltas.append(delta)
        self.tasks_done += delta.tasks

    def _keep(self, health: Health) -> None:
        self.health[health.instance] = health

    @property
    def versions(self) -> list[int]:
        return [delta.version for delta in self.deltas]

    def goes_on(self, cycles: int) -> None:
        """Wait until so many cycles more have ended, each with a task done in it."""
        began = len(self.deltas)

        def enough() -> bool:
            return len({delta.cycle for delta in self.deltas[began:] if delta.tasks}) >= cycles

        wait_until(enough, f"{cycles} cycles more")

    def agrees(self) -> None:
        """Wait until the graph here is that of the workspace. What feeds it must have paused."""
        wait_until(
            lambda: self._truth().digest() == self.graph.digest(),
            "the replica is the workspace's graph",
        )

    def _truth(self) -> Graph:
        graph = Graph()
        try:
            answer = self._bus.query(topics.SNAPSHOT_REQUEST, encode(SnapshotRequest()), 2.0)
        except NoAnswerError:
            return graph
        snapshot = decode(topics.SNAPSHOT, answer.payload)
        assert isinstance(snapshot, Snapshot)
        graph.load(snapshot)
        return graph
