"""The agent's position error over that of fused self-motion alone, on laps of several towns.

The drives run in lockstep in one process each, so the errors do not depend on the machine's load.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.report import Metrics
from cli.launch.observer import Observer, Track
from cli.launch.plan import OBSERVER, Choices, effective, everybody
from cogmap.errors import CogmapError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from experiments.parallel import parallel_map
from schemas import topics
from schemas.sensing import SelfMotion, TruePose
from services import registry

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
    ratios = [errors.estimate_m / errors.fused_m for errors in drives]

    metrics = {
        "error_over_fused": float(np.mean(ratios)),
        "estimate_error_m": float(np.mean([errors.estimate_m for errors in drives])),
        "fused_self_motion_error_m": float(np.mean([errors.fused_m for errors in drives])),
        "wheels_error_m": float(np.mean([errors.wheels_m for errors in drives])),
    }
    for town, ratio in zip(TOWNS, ratios, strict=True):
        metrics[f"error_over_fused_town_{town}"] = ratio

    return metrics


def mean_errors(town: int, laps: float) -> MeanErrors:
    """Drive `laps` of the town of that seed. Raises CogmapError where the route is not completed."""
    choices = Choices(seed=town, laps=laps, lockstep=True, record=False)
    sections = effective({}, choices, everybody(choices, observer=True))
    follower = Follower()
    modules = [registry.build(name, sections) for name in registry.MODULES]
    runner = InProcessRunner([*modules, follower.module()])

    try:
        runner.run(lambda: follower.progress >= 1.0)
    finally:
        runner.close()

    if follower.progress < 1.0:
        raise CogmapError(f"the drive of town {town} ended at {follower.progress:.0%} of its route")

    return follower.mean_errors()


class Follower:
    """Follows one drive: the truth, the estimates, and self-motion integrated on its own."""

    def __init__(self) -> None:
        self._observer = Observer()
        self._true = Track()
        self._fused = Track()
        self._pose = np.zeros(3)

    @property
    def progress(self) -> float:
        """The share of the route that is driven."""
        return self._observer.progress

    def module(self) -> Module:
        """The module `observer`, whom the simulator waits for."""
        module = Module(OBSERVER)

        for topic in (topics.TRUE_TOWN, topics.ODOMETRY, topics.DELTA):
            module.on(topic, self._observer.take)

        return module.on(topics.TRUE_POSE, self._on_true_pose).on(
            topics.SELF_MOTION, self._on_self_motion
        )

    def mean_errors(self) -> MeanErrors:
        """Of all estimates so far."""
        errors = self._observer.errors()
        fused_m = self._observer.to_world(self._fused.at(errors.stamps_ns))
        off_m = np.linalg.norm(fused_m - self._true.at(errors.stamps_ns), axis=1)

        return MeanErrors(
            estimate_m=float(errors.estimate_m.mean()),
            fused_m=float(off_m.mean()),
            wheels_m=float(errors.integration_m.mean()),
        )

    def _on_true_pose(self, true: TruePose) -> None:
        self._observer.take(true)
        self._true.add(true.stamp_ns, true.pose.x_m, true.pose.y_m)

    def _on_self_motion(self, motion: SelfMotion) -> None:
        """Midpoint integration, as of the wheels."""
        if not len(self._fused):
            self._fused.add(motion.since_ns, 0.0, 0.0)

        for speed_m_s, turn_rate_rad_s, dt_s, *_ in motion.motions.numpy().tolist():
            middle_rad = self._pose[2] + turn_rate_rad_s * dt_s / 2
            step_m = speed_m_s * dt_s
            self._pose[0] += step_m * np.cos(middle_rad)
            self._pose[1] += step_m * np.sin(middle_rad)
            self._pose[2] += turn_rate_rad_s * dt_s

        self._fused.add(motion.stamp_ns, float(self._pose[0]), float(self._pose[1]))
