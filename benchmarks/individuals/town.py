"""One visit of a town, and what it gave."""

from __future__ import annotations

import enum
import gc
import json
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness import (
    agent_modules,
    build,
    running,
    town_sections,
)
from benchmarks.individuals.closures import wrong_closures
from benchmarks.individuals.names import judged_names
from benchmarks.individuals.visitor import Plan, Visitor
from cogmap.bus.memory import MemoryBus
from cogmap.cli.launch.individuals.judge import BuildingMetrics
from cogmap.experiments.individuals.places import equal_houses, never_taught
from cogmap.experiments.individuals.simulated import simulator
from cogmap.recording.recorder import Recorder
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.services import registry

ERROR_S = 600.0
"""How long the agent's error is compared with that of fused self-motion alone."""

KEPT = tuple(
    topic for topic in topics.ALL if topic.keep_in_log and topic not in (topics.STEREO, topics.VIEW)
)
"""The pictures are most of a log, and nothing that is replayed after perception needs them."""


class Houses(enum.StrEnum):
    """What stands in a town: buildings that nobody was taught; some of these and some that
    perception was taught; or equal houses of two looks, at the level of percepts.
    """

    NEVER_TAUGHT = "never_taught"
    MIXED = "mixed"
    EQUAL = "equal"


@dataclass(frozen=True)
class Visit:
    """A town by its seed and houses, what is done there, and the log to keep of it, if any."""

    seed: int
    houses: Houses
    plan: Plan
    log: Path | None = None


@dataclass(frozen=True)
class Town:
    """What a visit gave: the buildings on the map once the agent had explored, and in the end;
    whether each building was reached; the taught names of percepts, each with its activation and
    whether it is right; the mean distances from the truth of the estimate and of fused self-motion
    alone; closures accepted, and wrong ones; how long it took.
    """

    visit: Visit
    explored: BuildingMetrics
    final: BuildingMetrics
    reached: list[bool]
    names: list[tuple[float, bool]]
    estimate_m: float
    fused_m: float
    closures: int
    wrong_closures: int
    drive_s: float
    wall_s: float


def visit(chosen: Visit) -> Town:
    """Explore a town, and drive to its buildings. Raises CogmapError if a module rejected a
    message.
    """
    began_s = time.monotonic()
    has_cameras = chosen.houses is not Houses.EQUAL
    sections = town_sections(chosen.seed, has_cameras)
    visitor = Visitor(chosen.seed, chosen.plan)
    modules = [simulated(chosen, sections), *build(agent_modules(has_cameras), sections)]
    with running([*modules, visitor.watching()]) as runner:
        if chosen.log is None:
            runner.run(lambda: visitor.is_over)
        else:
            run_recorded(runner, visitor, chosen.log, sections)

    # A process has one renderer at a time, which goes with its module: now, before the next town.
    del modules, runner
    gc.collect()
    return result(chosen, visitor, time.monotonic() - began_s)


def simulated(chosen: Visit, sections: Sections) -> Module:
    """Return the simulation of the town."""
    if chosen.houses is Houses.MIXED:
        return registry.build("sim", sections)

    made = never_taught if chosen.houses is Houses.NEVER_TAUGHT else equal_houses
    return simulator(made(chosen.seed), sections)


def run_recorded(runner: InProcessRunner, visitor: Visitor, log: Path, sections: Sections) -> None:
    """Run until the visit is over, and write the log."""
    about = {"agent": "agent", "config": json.dumps(sections)}
    recorder = Recorder(MemoryBus(runner.network), log, KEPT, about)
    recorder.open()

    def is_over() -> bool:
        while recorder.pump():
            pass
        return visitor.is_over

    runner.run(is_over)
    recorder.close()


def result(chosen: Visit, visitor: Visitor, wall_s: float) -> Town:
    """Judge the visit."""
    assert visitor.explored is not None
    buildings = visitor.explored.buildings
    true = visitor.tally.true
    pose_at = dict(zip(true.stamps_ns.tolist(), true.poses, strict=True))
    errors = visitor.observer.errors()
    is_compared = errors.stamps_ns <= ERROR_S * 1e9
    closures, wrong = wrong_closures(visitor.closures.values(), pose_at, buildings)
    return Town(
        visit=chosen,
        explored=visitor.explored.metrics(),
        final=visitor.judged().metrics(),
        reached=visitor.reached,
        names=judged_names(visitor.percepts, pose_at, buildings),
        estimate_m=float(errors.estimate_m[is_compared].mean()),
        fused_m=float(errors.fused_m[is_compared].mean()),
        closures=closures,
        wrong_closures=wrong,
        drive_s=visitor.now_s,
        wall_s=wall_s,
    )
