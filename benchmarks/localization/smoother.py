"""What mapping is compared with: a batch smoother of gtsam's, which gets the whole log at once."""

from __future__ import annotations

import numpy as np

from benchmarks import optional
from benchmarks.localization.senses import Moment
from cogmap.geometry.arrays import Floats
from schemas.sensing import Percept

STEPS = 100
MIN_SD = 1e-4
SIDEWAYS_SHARE = 0.2
CAUCHY = 2.0


def smooth(moments: list[Moment]) -> Floats:
    """(n, 3) poses at the moments that fit all percepts and motions best; the start is at 0.

    Levenberg-Marquardt on the same percepts, motions and noise that the codelets get; landmarks are
    unknown. Raises UsageError where gtsam is not installed.
    """
    problem = Problem()

    for moment in moments:
        problem.add(moment)

    return problem.solve()


class Problem:
    """A factor graph of the poses at the moments and of the landmarks seen.

    Observations weigh by Cauchy's function, so that a landmark taken for another does not count for
    much.
    """

    def __init__(self) -> None:
        self._gtsam = optional.gtsam()
        self._graph = self._gtsam.NonlinearFactorGraph()
        self._start = self._gtsam.Values()
        self._count = 0
        self._pose = self._gtsam.Pose2(0.0, 0.0, 0.0)

        fixed = self._gtsam.noiseModel.Constrained.All(3)
        self._start.insert(self._key(0), self._pose)
        self._graph.add(self._gtsam.PriorFactorPose2(self._key(0), self._pose, fixed))

    def add(self, moment: Moment) -> None:
        """Add the next pose, by path integration from the last, and what is seen from it."""
        step, sd = _step(moment.motions)
        motion = self._gtsam.Pose2(*step)
        noise = self._gtsam.noiseModel.Diagonal.Sigmas(sd)
        before = self._key(self._count)
        self._count += 1
        here = self._key(self._count)

        self._graph.add(self._gtsam.BetweenFactorPose2(before, here, motion, noise))
        self._pose = self._pose.compose(motion)
        self._start.insert(here, self._pose)

        for percept in moment.percepts:
            self._observe(here, percept)

    def solve(self) -> Floats:
        """(n, 3) poses, without the start."""
        parameters = self._gtsam.LevenbergMarquardtParams()
        parameters.setMaxIterations(STEPS)
        optimizer = self._gtsam.LevenbergMarquardtOptimizer(self._graph, self._start, parameters)
        found = optimizer.optimize()
        poses = [found.atPose2(self._key(number)) for number in range(1, self._count + 1)]
        return np.array([(pose.x(), pose.y(), pose.theta()) for pose in poses])

    def _observe(self, here: int, percept: Percept) -> None:
        gtsam = self._gtsam
        landmark = gtsam.symbol("l", int(percept.label.rpartition("-")[2]))
        sds = np.array([percept.bearing_sd_rad, percept.range_sd_m])
        robust = gtsam.noiseModel.mEstimator.Cauchy.Create(CAUCHY)
        noise = gtsam.noiseModel.Robust.Create(robust, gtsam.noiseModel.Diagonal.Sigmas(sds))
        bearing = gtsam.Rot2(percept.bearing_rad)
        self._graph.add(gtsam.BearingRangeFactor2D(here, landmark, bearing, percept.range_m, noise))

        if not self._start.exists(landmark):
            direction = np.array([np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)])
            where = self._pose.transformFrom(percept.range_m * direction)
            self._start.insert(landmark, where)

    def _key(self, number: int) -> int:
        key: int = self._gtsam.symbol("x", number)
        return key


def _step(rows: Floats) -> tuple[Floats, Floats]:
    """The pose that (n, 5) rows of motion lead to from 0, and its standard deviations."""
    speed, turn_rate, dt, speed_sd, turn_rate_sd = rows.T
    turn = turn_rate * dt
    middle_rad = np.cumsum(turn) - turn / 2
    distance_m = speed * dt

    forwards_m = (distance_m * np.cos(middle_rad)).sum()
    left_m = (distance_m * np.sin(middle_rad)).sum()
    distance_sd_m = float(np.sqrt(np.square(speed_sd * dt).sum()))
    turn_sd_rad = float(np.sqrt(np.square(turn_rate_sd * dt).sum()))

    step = np.array([forwards_m, left_m, turn.sum()])
    sds = np.array([distance_sd_m, SIDEWAYS_SHARE * distance_sd_m, turn_sd_rad])
    return step, sds + MIN_SD
