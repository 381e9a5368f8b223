"""The cognitive cycle on a map that is there already: CPU time, bytes of deltas and of tasks."""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass, field

import numpy as np

from benchmarks.map_size.maps import CELL_M
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus
from cogmap.errors import CogmapError
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.schemas import topics
from cogmap.schemas.graph import Snapshot
from cogmap.services import registry

COGNITION = ("workspace", "codelets", "global_workspace", "procedural", "action", "motor")
MODULES = ("sim", *COGNITION)
WARM_UP = 10
CYCLES = 60
SPEED_M_S = 2.0
LENGTH_M = 400.0
APART_M = 12.0
ASIDE_M = 8.0


@dataclass
class Cycles:
    """What was measured of each cycle: the CPU time of all modules and the bytes of its deltas; and
    the bytes of every task.
    """

    cpu_s: list[float] = field(default_factory=list)
    delta_bytes: list[int] = field(default_factory=list)
    task_bytes: list[int] = field(default_factory=list)

    @property
    def mean_cpu_s(self) -> float:
        """The mean over the cycles after the first few."""
        measured_s = self.cpu_s[WARM_UP:]
        return float(np.mean(measured_s))

    @property
    def mean_delta_bytes(self) -> float:
        """The mean over the cycles after the first few."""
        measured = self.delta_bytes[WARM_UP:]
        return float(np.mean(measured))

    @property
    def task_bytes_p99(self) -> float:
        """99 % of the tasks have at most so many bytes."""
        return float(np.percentile(self.task_bytes, 99))


def sections() -> Sections:
    """Percept-level sensing along a street with buildings on both sides, in lockstep."""
    landmarks = []
    for number, x_m in enumerate(np.arange(0.0, LENGTH_M, APART_M).tolist()):
        is_left = number % 2
        landmark = {
            "name": f"house-{number:02d}",
            "x_m": x_m,
            "y_m": ASIDE_M if is_left else -ASIDE_M,
        }
        landmarks.append(landmark)

    trajectory = {
        "line_m": [[0.0, 0.0], [LENGTH_M, 0.0]],
        "landmarks": landmarks,
        "speed_m_s": SPEED_M_S,
    }
    sim = {
        "mode": "lockstep",
        "trajectory": trajectory,
        "frame_hz": 1,
        "awaits": dict.fromkeys(COGNITION, 1),
    }
    return {
        "sim": sim,
        "workspace": {"mode": "lockstep", "cell_m": CELL_M, "base_level_decay": 0.0},
        "procedural": {"mode": "lockstep"},
        "motor": {"mode": "lockstep"},
    }


class _Meter:
    """Notes what each cycle took, as its deltas and tasks are published."""

    def __init__(self) -> None:
        self.cycles = Cycles()
        self._began_s = time.process_time()
        self._bytes = 0

    def listen(self, bus: MemoryBus) -> None:
        """Subscribe to the topics that it measures."""
        bus.subscribe(topics.DELTA, self._on_delta, _ignore_gap)
        bus.subscribe(topics.TASK, self._on_task, _ignore_gap)
        bus.subscribe(topics.MOTOR_COMMAND, self._on_command, _ignore_gap)

    def has_enough(self) -> bool:
        """Whether CYCLES were measured after the first few."""
        return len(self.cycles.cpu_s) >= WARM_UP + CYCLES

    def _on_delta(self, arrival: Arrival) -> None:
        self._bytes += len(arrival.payload)

    def _on_task(self, arrival: Arrival) -> None:
        size = len(arrival.payload)
        self.cycles.task_bytes.append(size)

    def _on_command(self, arrival: Arrival) -> None:
        """The last message of a cycle in lockstep."""
        now_s = time.process_time()
        took_s = now_s - self._began_s
        self.cycles.cpu_s.append(took_s)
        self.cycles.delta_bytes.append(self._bytes)

        self._began_s = now_s
        self._bytes = 0


def _ignore_gap(source: str, count: int) -> None:
    """The bus in memory loses nothing."""


def drive(learned: Snapshot) -> Cycles:
    """Run some cycles on a map that was learned before. Raises CogmapError where a module rejected
    a message.
    """
    configured = sections()
    workspace = registry.build("workspace", configured)
    if workspace.restore is not None:
        workspace.restore([learned])

    others = [registry.build(name, configured) for name in MODULES if name != "workspace"]
    runner = InProcessRunner([workspace, *others])
    meter = _Meter()
    meter.listen(MemoryBus(runner.network))
    gc.collect()

    runner.run(meter.has_enough)
    for shell in runner.shells:
        rejected = dict(shell.intake.rejected)
        if rejected:
            raise CogmapError(f"{shell.module.name} rejected {rejected}")

    runner.close()
    return meter.cycles
