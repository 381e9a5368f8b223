"""The agent's position error over that of fused self-motion alone, on laps of several towns.

The drives run in lockstep in one process each, so the errors do not depend on the machine's load.
"""

from __future__ import annotations

import gc
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.report import Metrics
from cogmap.cli.launch.observer import OBSERVED, Observer
from cogmap.cli.launch.plan import OBSERVER, Choices, effective
from cogmap.errors import CogmapError
from cogmap.parallel import parallel_map
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.services import registry

TOWNS = (1, 2, 3)
LAPS = 3.0


@dataclass(frozen=True)
class MeanErrors:
    """Mean distances from the truth over one drive, at the stamps of the estimates."""

    estimate_m: float
    fused_m: float
    wheels_m: float


def over_fused(processes: int) -> Metrics:
    """`error_over_fused`, the mean over the towns of each one's ratio, and the errors behind it."""
    drives = parallel_map(partial(mean_errors, laps=LAPS), TOWNS, processes)
    rows = [(errors.estimate_m, errors.fused_m, errors.wheels_m) for errors in drives]
    estimate_m, fused_m, wheels_m = np.array(rows).T
    ratios = estimate_m / fused_m

    metrics = {
        "error_over_fused": float(ratios.mean()),
        "estimate_error_m": float(estimate_m.mean()),
        "fused_self_motion_error_m": float(fused_m.mean()),
        "wheels_error_m": float(wheels_m.mean()),
    }
    for town, ratio in zip(TOWNS, ratios.tolist(), strict=True):
        metrics[f"error_over_fused_town_{town}"] = ratio

    return metrics


def mean_errors(town: int, laps: float) -> MeanErrors:
    """Drive `laps` of the town of that seed. Raises CogmapError where not all goals are reached."""
    observer = _drive(town, laps)
    # A process has one renderer at a time, which goes with its module: now, before the next town.
    gc.collect()

    errors = observer.errors()
    return MeanErrors(
        estimate_m=float(errors.estimate_m.mean()),
        fused_m=float(errors.fused_m.mean()),
        wheels_m=float(errors.wheels_m.mean()),
    )


def _drive(town: int, laps: float) -> Observer:
    """Run all modules in this process until every goal is reached."""
    choices = Choices(seed=town, laps=laps, lockstep=True, record=False)
    sections = effective({}, choices, observer=True)
    observer = Observer()
    modules = [registry.build(name, sections) for name in registry.MODULES]
    runner = InProcessRunner([*modules, _observing(observer)])

    try:
        runner.run(lambda: observer.has_ended)
    finally:
        runner.close()

    if observer.goals_reached < observer.goals:
        reached = f"{observer.goals_reached} of {observer.goals} goals"
        raise CogmapError(f"the drive of town {town} ended at {reached}")

    return observer


def _observing(observer: Observer) -> Module:
    """The module `observer`, whom the simulator waits for."""
    module = Module(OBSERVER)
    for topic in OBSERVED:
        module.on(topic, observer.update)

    return module
