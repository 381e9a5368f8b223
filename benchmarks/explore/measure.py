"""Metrics of exploration, and of drives to goals: ten towns, percept-level sensing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import msgspec
import numpy as np

from benchmarks.explore.boundaries import BoundaryScore
from benchmarks.explore.experimenter import Experimenter
from benchmarks.explore.trials import Trial
from benchmarks.report import Metrics
from benchmarks.threshold import at_least, at_most
from cogmap.errors import CogmapError
from cogmap.parallel import Progress, parallel_map
from cogmap.runtime.config import Sections
from cogmap.runtime.in_process import InProcessRunner
from services import registry
from services.action.config import NEAREST_SCAN_M
from services.sim.odometry import FUSED

TOWNS = 10
FIRST_SEED = 101
EXPLORE_S = 900.0
GOALS = 10
LONGEST_S = 6000.0
CLOSURE_SPACING_S = 10.0
"""Between two loop closures: on streets that are driven again and again there is one at any time,
and each makes map correction judge all of them.
"""
COGNITION = ("workspace", "codelets", "global_workspace", "action")
THRESHOLDS = {
    "explored_share": at_least(0.9),
    "goals_reached_share": at_least(0.98),
    "way_over_shortest": at_most(1.15),
    "collisions": at_most(0),
    "boundary_precision": at_least(0.9),
    "boundary_recall": at_least(0.9),
}


@dataclass(frozen=True)
class Town:
    """What one town gave."""

    explored_share: float
    boundaries: BoundaryScore
    trials: list[Trial]
    collisions: int


def sections(seed: int) -> Sections:
    """A town of several blocks, percept-level sensing, a robot that explores, in lockstep."""
    sim = {
        "seed": seed,
        "mode": "lockstep",
        "town": "blocks",
        "sensing": "percepts",
        "duration_s": LONGEST_S,
        "noise": msgspec.to_builtins(FUSED),
        "awaits": dict.fromkeys(COGNITION, 1),
    }
    return {
        "sim": sim,
        "workspace": {"mode": "lockstep"},
        "action": {"mode": "lockstep", "clearance_m": NEAREST_SCAN_M},
        "codelets": {"closure_spacing_s": CLOSURE_SPACING_S},
        "planning": {"explore": True},
    }


def visit(explore_s: float, goals: int, seed: int) -> Town:
    """Explore one town, then drive to goals in it. Raises CogmapError where a module rejected a
    message.
    """
    configured = sections(seed)
    experimenter = Experimenter(seed, explore_s, goals)
    modules = [registry.build(name, configured) for name in ("sim", *COGNITION)]
    with InProcessRunner([*modules, experimenter.module()]) as runner:
        runner.run(lambda: experimenter.is_complete)
        for shell in runner.shells:
            if shell.intake.rejected:
                raise CogmapError(f"{shell.module.name} rejected {dict(shell.intake.rejected)}")

    assert experimenter.boundaries is not None
    return Town(
        explored_share=experimenter.explored_share,
        boundaries=experimenter.boundaries,
        trials=experimenter.trials,
        collisions=experimenter.collisions,
    )


def measure(
    processes: int,
    progress: Progress = lambda share: None,
    *,
    towns: int = TOWNS,
    explore_s: float = EXPLORE_S,
    goals: int = GOALS,
) -> Metrics:
    """The metrics over all towns."""
    seeds = range(FIRST_SEED, FIRST_SEED + towns)
    work = partial(visit, explore_s, goals)
    return metrics(parallel_map(work, seeds, processes, progress))


def metrics(towns: list[Town]) -> Metrics:
    """The means over towns, and over all drives that reached their goal."""
    trials = [trial for town in towns for trial in town.trials]
    reached = [trial for trial in trials if trial.driven_m is not None]
    shares = [town.explored_share for town in towns]

    return {
        "explored_share": float(np.mean(shares)),
        "goals_reached_share": len(reached) / max(1, len(trials)),
        "way_over_shortest": _mean_over_shortest(reached),
        "way_over_shortest_open": _mean_over_shortest(
            [each for each in reached if not each.closed]
        ),
        "boundary_precision": float(np.mean([town.boundaries.precision for town in towns])),
        "boundary_recall": float(np.mean([town.boundaries.recall for town in towns])),
        "collisions": float(sum(town.collisions for town in towns)),
    }


def _mean_over_shortest(trials: list[Trial]) -> float:
    ratios = [trial.over_shortest for trial in trials]
    return float(np.mean(ratios)) if ratios else float("nan")
