"""The cognitive cycle on a map that is there already: CPU time, bytes of deltas and of tasks."""

from __future__ import annotations

import gc
from typing import NamedTuple

import numpy as np

from benchmarks.harness import COGNITION, CycleMeter, build, ignore_gap, running
from benchmarks.map_size.maps import CELL_M
from cogmap.bus.memory import MemoryBus
from cogmap.runtime.config import Sections
from cogmap.schemas import topics
from cogmap.schemas.graph import Snapshot

PARTICIPANTS = ("sim", "workspace", "global_workspace")
"""Not motor: the first cycle on a map of another run would wait for its offer in the one before."""
WARM_UP = 10
CYCLES = 60
SPEED_M_S = 2.0
LENGTH_M = 400.0
APART_M = 12.0
ASIDE_M = 8.0


class Cycles(NamedTuple):
    """The means of a cycle's CPU time, of all modules, and of the bytes of its deltas, over the
    `cycles` after the first few; 99 % of all tasks have at most `task_bytes_p99`.
    """

    cycles: int
    mean_cpu_s: float
    mean_delta_bytes: float
    task_bytes_p99: float


def sections() -> Sections:
    """Configure percept-level sensing along a street with buildings on both sides, in lockstep."""
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
        "trajectory": trajectory,
        "frame_hz": 1,
    }
    return {
        "run": {"lockstep": True, "participants": dict.fromkeys(PARTICIPANTS, 1)},
        "sim": sim,
        "workspace": {"cell_m": CELL_M, "base_level_decay": 0.0},
    }


def drive(learned: Snapshot) -> Cycles:
    """Run some cycles on a map that was learned before. Raises CogmapError if a module rejected a
    message.
    """
    modules = build(("workspace", "sim", *COGNITION[1:]), sections())
    workspace = modules[0]
    if workspace.restore is not None:
        workspace.restore([learned])

    meter = CycleMeter()
    task_bytes: list[int] = []
    with running(modules) as runner:
        meter.listen(runner, [topics.DELTA])
        MemoryBus(runner.network).subscribe(
            topics.TASK, lambda task: task_bytes.append(len(task.payload)), ignore_gap
        )
        gc.collect()
        runner.run(lambda: meter.cycles >= WARM_UP + CYCLES)

    cpu_s, delta_bytes = meter.spent(WARM_UP, meter.cycles)
    return Cycles(
        cycles=meter.cycles - WARM_UP,
        mean_cpu_s=cpu_s,
        mean_delta_bytes=delta_bytes,
        task_bytes_p99=float(np.percentile(task_bytes, 99)),
    )
