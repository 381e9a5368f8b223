"""The metrics of loop closing: errors by method, and what the first replay predicts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cogmap.experiments.loop_closing.observer import Loop, rms_m
from cogmap.experiments.loop_closing.rule import close_laps
from cogmap.experiments.loop_closing.run import CORNERS_M, FRAME_HZ, NOISE, SPEED_M_S
from cogmap.experiments.loop_closing.solvers import Solvers
from cogmap.experiments.predictions.replayed import strength_fit
from cogmap.services.sim.odometry import Noise

LAPS = 1000
PASSES = (0, 1, 10, 1000)
ERRORS = ("path_error", "object_error", "end_error")
Metrics = dict[str, float]


def loop_metrics(loops: Mapping[str, Loop]) -> Metrics:
    """Return errors before and after the first correction and in the end, by the method of
    correction.

    `positions` corrects these alone, by reverse replay or, with the paper's rules, by eq. 9 as it
    is printed; `heading` is ours. `path_error_wheels_alone_m` and
    `path_error_fused_alone_m` are of the path by path integration alone: of the wheels, and of
    self-motion as the agent has it; they are the same if no images are taken. `path_over_fused_...`
    is the path's error in the end over the latter.
    """
    metrics: Metrics = {}
    for method, loop in loops.items():
        maps = {"before": loop.before, "after": loop.after, "in_the_end": loop.end}
        for error in ERRORS:
            for when, learned in maps.items():
                metrics[f"{error}_{when}_m_{method}"] = getattr(learned, f"{error}_m")
        metrics[f"corrections_{method}"] = float(len(loop.replays))
        metrics[f"replays_of_the_first_{method}"] = float(loop.replays[0].passes)

    loop = loops["positions"]
    true_path_m = loop.end.true_path_m
    metrics["path_error_wheels_alone_m"] = rms_m(loop.wheels_path_m - true_path_m)
    fused_m = rms_m(loop.fused_path_m - true_path_m)
    metrics["path_error_fused_alone_m"] = fused_m
    if fused_m > 0:
        for method, each in loops.items():
            metrics[f"path_over_fused_{method}"] = each.end.path_error_m / fused_m

    # The change of synapses for a metre that place fields come nearer is k, if they are close.
    replay = loop.replays[0]
    metrics["synapse_decay_per_m"] = replay.decay_per_m
    metrics |= strength_fit("close_pairs", replay, replay.close)
    return metrics | strength_fit("all_pairs", replay, np.ones_like(replay.close))


def solver_metrics(solved: Solvers) -> dict[str, float | None]:
    """Return for each solver of the first loop what is left after so many passes over the path: eq.
    7 over its least, the distance from the path of the least cost, and the error of the path; and
    after how many the cost is within one percent of the least, None if that is never.
    """
    metrics: dict[str, float | None] = {
        "solved_places": float(solved.places),
        "solved_closures": float(solved.closures),
        "solved_path_error_m": solved.least_path_error_m,
    }
    for name, curve in solved.curves.items():
        metrics[f"{name}_solved_after_passes"] = curve.solved_after
        for passes in PASSES:
            if passes < len(curve.path_error_m):
                after = f"after_{passes}_passes"
                metrics[f"{name}_cost_over_least_{after}"] = float(curve.cost_over_least[passes])
                metrics[f"{name}_from_solution_{after}_m"] = float(curve.from_solution_m[passes])
                metrics[f"{name}_path_error_{after}_m"] = float(curve.path_error_m[passes])

    return metrics


def rule_metrics(seed: int) -> Metrics:
    """Return what eq. 9 does for many laps of the wheels alone, with the headings' noise and
    without.
    """
    exact_headings = Noise(speed=NOISE.speed, turn=0.0, drift_rad_per_sqrt_m=0.0)
    metrics: Metrics = {}

    step_m = SPEED_M_S / FRAME_HZ
    for name, noise in (("", NOISE), ("_exact_headings", exact_headings)):
        laps = close_laps(CORNERS_M, step_m, noise, LAPS, seed)
        metrics[f"rule_over_uncorrected{name}"] = laps.ratio
        metrics[f"rule_helps_share{name}"] = laps.helped

    return metrics
