"""A town in lockstep that several benchmarks measure in, and modules that follow a drive in it."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import msgspec
import numpy as np

from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from, transform_to
from cogmap.graph.graph import Graph
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import Pose, TruePose, TrueTown
from cogmap.schemas.topics import Topic
from cogmap.services import registry
from cogmap.services.sim.public import odometry

MAX_DRIVE_S = 6000.0
# A plan of these towns takes some 20 ms, a tenth of a cycle.
PLANNING_CYCLES = 1
COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
SENSES = ("sensory", "epam")


def agent_modules(has_cameras: bool = False) -> tuple[str, ...]:
    """Return the names of the agent's modules, that the simulator waits for."""
    return (*SENSES, *COGNITION) if has_cameras else COGNITION


def town_sections(seed: int, has_cameras: bool = False) -> Sections:
    """Configure a town of several blocks and a robot that explores, in lockstep; percept-level
    sensing unless it has cameras.
    """
    sim: dict[str, Any] = {
        "seed": seed,
        "town": "blocks",
        "sensing": "cameras" if has_cameras else "percepts",
        "duration_s": MAX_DRIVE_S,
    }
    if not has_cameras:
        sim["noise"] = msgspec.to_builtins(odometry.FUSED)

    return {
        "run": {
            "lockstep": True,
            "participants": dict.fromkeys(("sim", *agent_modules(has_cameras)), 1),
        },
        "sim": sim,
        "workspace": {"background_cycles": PLANNING_CYCLES},
        "planning": {"explore": True},
    }


def build(names: Iterable[str], sections: Sections) -> list[Module]:
    """Build modules of the system by name."""
    return [registry.build(name, sections) for name in names]


@contextmanager
def running(modules: Sequence[Module]) -> Iterator[InProcessRunner]:
    """Give a runner of the modules. Raises CogmapError in the end if one rejected a message."""
    with InProcessRunner(modules) as runner:
        yield runner
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")


class TownObserver:
    """Follows the true town, the robot's true pose and the agent's graph. `start` is the true pose
    (3,) in which the robot began, the origin of the agent's map.
    """

    def __init__(self) -> None:
        self.graph = Graph()
        self.town: TrueTown | None = None
        self.start: Floats | None = None

    def module(self, name: str, emits: Iterable[Topic] = ()) -> Module:
        """Return the module to run beside the agent's."""
        return (
            Module(name)
            .following(self.graph, self.on_delta)
            .on(topics.TRUE_TOWN, self.on_town)
            .on(topics.TRUE_POSE, self.on_pose, emits)
        )

    def on_town(self, town: TrueTown) -> None:
        """Take the town as it is now."""
        self.town = town

    def on_delta(self, delta: Delta) -> None:
        """Look at the graph after a change of it."""

    def on_pose(self, true: TruePose) -> list[Message]:
        """Take the robot's pose, and return what to publish."""
        if self.start is None:
            self.start = pose_array(true.pose)

        return self.act(true)

    def act(self, true: TruePose) -> list[Message]:
        """Return what to publish now that the robot is there."""
        return []

    def to_map(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the true frame to that of the agent's map."""
        assert self.start is not None
        return transform_to(self.start, points_m)

    def to_truth(self, points_m: Floats) -> Floats:
        """Transform points (n, 2) of the agent's map to the true frame."""
        assert self.start is not None
        return transform_from(self.start, points_m)


def pose_array(pose: Pose) -> Floats:
    """Return x, y and heading, (3,)."""
    return np.array([pose.x_m, pose.y_m, pose.heading_rad])


class Mark(NamedTuple):
    """The CPU time and the bytes of messages spent by the end of a cycle."""

    cpu_s: float
    message_bytes: int


class CycleMeter:
    """Notes what all modules had spent at the end of each cycle, which is the motor command's."""

    def __init__(self) -> None:
        self.marks = [Mark(time.process_time(), 0)]
        self._message_bytes = 0

    @property
    def cycles(self) -> int:
        """Return the number of cycles that have ended."""
        return len(self.marks) - 1

    def listen(self, runner: InProcessRunner, counted: Iterable[Topic]) -> None:
        """Count the bytes of the messages on some topics, as the recorder receives them."""
        bus = MemoryBus(runner.network)
        for topic in counted:
            bus.subscribe(topic, self._on_message, ignore_gap)
        bus.subscribe(topics.MOTOR_COMMAND, self._on_command, ignore_gap)

    def spent(self, first: int, last: int) -> tuple[float, float]:
        """Return the mean CPU time and bytes of the cycles after `first` up to `last`."""
        cpu_s, message_bytes = np.subtract(self.marks[last], self.marks[first]) / (last - first)
        return float(cpu_s), float(message_bytes)

    def _on_message(self, arrival: Arrival) -> None:
        self._message_bytes += len(arrival.payload)

    def _on_command(self, arrival: Arrival) -> None:
        self.marks.append(Mark(time.process_time(), self._message_bytes))


def ignore_gap(source: str, count: int) -> None:
    """Do nothing: the bus in memory loses nothing."""
