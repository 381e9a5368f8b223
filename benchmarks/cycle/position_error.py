"""The agent's position error over that of fused self-motion alone, on laps of several towns.

The drives run in lockstep in one process each, so the errors do not depend on the machine's load.
"""

from __future__ import annotations

import gc
from functools import partial

import numpy as np

from benchmarks.harness import build, running
from benchmarks.report import Metrics
from cogmap.cli.launch.observer import OBSERVED, Observer
from cogmap.cli.launch.plan import OBSERVER, Choices, effective
from cogmap.cli.progress import bar
from cogmap.errors import CogmapError
from cogmap.parallel import parallel_map
from cogmap.runtime.module import Module
from cogmap.services import registry

TOWNS = (1, 2, 3)
LAPS = 3.0


def over_fused(processes: int) -> Metrics:
    """Measure `error_over_fused`, the mean of the towns' ratios, and the errors behind it."""
    with bar("laps") as progress:
        work = partial(mean_errors_m, laps=LAPS)
        rows = parallel_map(work, TOWNS, processes, progress)

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


def mean_errors_m(town: int, laps: float) -> tuple[float, float, float]:
    """Drive `laps` of a seed's town; return the mean distances from the truth of the estimate, of
    fused self-motion alone and of wheels alone. Raises CogmapError if not all goals are reached.
    """
    choices = Choices(seed=town, laps=laps, lockstep=True, record=False)
    sections = effective({}, choices, observer=True)

    # The simulator waits for the observer too.
    observer = Observer()
    watching = Module(OBSERVER)
    for topic in OBSERVED:
        watching.on(topic, observer.update)

    with running([*build(registry.taking_part(), sections), watching]) as runner:
        runner.run(lambda: observer.has_ended)

    if observer.goals_reached < observer.goals:
        reached = f"{observer.goals_reached} of {observer.goals} goals"
        raise CogmapError(f"the drive of town {town} ended at {reached}")

    # A process has one renderer at a time, which goes with its module: now, before the next town.
    del runner
    gc.collect()

    errors = observer.errors()
    means_m = [each.mean() for each in (errors.estimate_m, errors.fused_m, errors.wheels_m)]
    estimate_m, fused_m, wheels_m = map(float, means_m)
    return estimate_m, fused_m, wheels_m
