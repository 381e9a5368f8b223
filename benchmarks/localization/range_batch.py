"""The peer of mapping by ranges: gtsam's batch with range factors, which gets the log at once.

It is solved with the ranges as they are, and with the one gain of all ranges that fits best, as
radios that nobody calibrated have: gtsam has no factor for that, so it is searched for outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from benchmarks import optional
from benchmarks.localization.senses import Moment
from benchmarks.localization.smoother import CAUCHY, STEPS, step_of
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose
from cogmap.parallel import Progress

LARGEST_GAIN = 0.2
SEARCHES = 14
FIRST_DIRECTIONS = 8
SAMPLED = 100


class _Problem:
    """A factor graph of the poses at the moments and of the landmarks heard, from the origin.

    `odometry` (n + 1, 3) are the poses by path integration, which it starts from.
    """

    def __init__(self, moments: Sequence[Moment]) -> None:
        self._gtsam = optional.gtsam()
        self._motions = self._gtsam.NonlinearFactorGraph()
        self._start = self._gtsam.Values()
        self._heard: list[tuple[int, int, float, float]] = []
        self._count = len(moments)

        fixed = self._gtsam.noiseModel.Constrained.All(3)
        origin = self._gtsam.Pose2(0.0, 0.0, 0.0)
        self._motions.add(self._gtsam.PriorFactorPose2(self._pose_key(0), origin, fixed))
        self._start.insert(self._pose_key(0), origin)

        pose = np.zeros(3)
        by_landmark: dict[int, list[tuple[float, float, float]]] = {}
        for number, moment in enumerate(moments, start=1):
            step, sds = step_of(moment.motions)
            noise = self._gtsam.noiseModel.Diagonal.Sigmas(sds)
            before, here = self._pose_key(number - 1), self._pose_key(number)
            motion = self._gtsam.Pose2(*step)
            self._motions.add(self._gtsam.BetweenFactorPose2(before, here, motion, noise))

            pose = compose(pose, step)
            self._start.insert(here, self._gtsam.Pose2(*pose))
            for percept in moment.percepts:
                _, _, landmark = percept.label.rpartition("-")
                key = self._gtsam.symbol("l", int(landmark))
                self._heard.append((here, key, percept.range_m, percept.range_sd_m))
                by_landmark.setdefault(key, []).append((*pose[:2].tolist(), percept.range_m))

        for key, rows in by_landmark.items():
            self._start.insert(key, _first_position(np.array(rows)))

    def solve(self, gain: float) -> tuple[Floats, float]:
        """Solve with all ranges divided by 1 + `gain`: (n, 2) positions, and what is left of the
        cost.
        """
        graph = self._gtsam.NonlinearFactorGraph(self._motions)
        models = self._gtsam.noiseModel
        for here, landmark, range_m, sd_m in self._heard:
            cauchy = models.mEstimator.Cauchy.Create(CAUCHY)
            noise = models.Robust.Create(cauchy, models.Isotropic.Sigma(1, sd_m / (1 + gain)))
            factor = self._gtsam.RangeFactor2D(here, landmark, range_m / (1 + gain), noise)
            graph.add(factor)

        parameters = self._gtsam.LevenbergMarquardtParams()
        parameters.setMaxIterations(STEPS)
        optimizer = self._gtsam.LevenbergMarquardtOptimizer(graph, self._start, parameters)
        found = optimizer.optimize()
        keys = [self._pose_key(number) for number in range(1, self._count + 1)]
        return optional.gtsam_poses(found, keys)[:, :2], float(graph.error(found))

    def _pose_key(self, number: int) -> Any:
        return self._gtsam.symbol("x", number)


def solve(moments: Sequence[Moment], progress: Progress) -> tuple[Floats, Floats]:
    """Return (n, 2) positions at the moments: with the ranges as they are, and divided by 1 + that
    gain, up to LARGEST_GAIN, which leaves the least cost.
    """
    problem = _Problem(moments)
    plain_m, _ = problem.solve(0.0)
    solved = 1
    progress(solved / (SEARCHES + 2))

    def cost(gain: float) -> float:
        nonlocal solved
        solved += 1
        progress(min(solved, SEARCHES + 1) / (SEARCHES + 2))
        _, left = problem.solve(gain)
        return left

    limits = (-LARGEST_GAIN, LARGEST_GAIN)
    best = minimize_scalar(cost, bounds=limits, method="bounded", options={"maxiter": SEARCHES})
    calibrated_m, _ = problem.solve(float(best.x))
    progress(1.0)
    return plain_m, calibrated_m


def _first_position(rows: Floats) -> Floats:
    """Return where a landmark is by (n, 3) rows of where the robot was by path integration and the
    range there: the best of the ends of least squares from several sides.
    """
    from scipy.optimize import least_squares

    chosen = rows[:: max(1, len(rows) // SAMPLED)]
    middle_m = chosen[:, :2].mean(axis=0)
    around_rad = np.linspace(0.0, 2 * np.pi, FIRST_DIRECTIONS, endpoint=False)
    directions = np.column_stack([np.cos(around_rad), np.sin(around_rad)])
    starts_m = middle_m + chosen[:, 2].mean() * directions

    def misfit(position_m: Floats) -> Floats:
        distance_m: Floats = np.hypot(*(chosen[:, :2] - position_m).T)
        return distance_m - chosen[:, 2]

    found = [least_squares(misfit, start_m, loss="cauchy") for start_m in starts_m]
    best = min(found, key=lambda each: each.cost)
    return np.asarray(best.x, np.float64)
