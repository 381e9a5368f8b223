"""The peers of mapping, gtsam's: a batch smoother, which gets the whole log at once, and iSAM2,
which estimates each pose when it is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks import optional
from benchmarks.localization.senses import Moment
from cogmap.geometry.arrays import Floats

STEPS = 100
MIN_SD = 1e-4
SIDEWAYS_SHARE = 0.2
CAUCHY = 2.0


def smooth(moments: Sequence[Moment]) -> Floats:
    """Return (n, 3) poses at the moments that fit all percepts and motions best; the start is at 0.

    Levenberg-Marquardt on the same percepts, motions and noise that the codelets get; landmarks are
    unknown. Raises UsageError if gtsam is not installed.
    """
    problem = Problem()

    for moment in moments:
        problem.add(moment)

    return problem.solve()


def smooth_online(moments: Sequence[Moment]) -> Floats:
    """Return (n, 3) poses, each as iSAM2 (Kaess et al. 2012) has it at its own moment; the start is
    at 0.

    On the same factors as `smooth`. Raises UsageError if gtsam is not installed.
    """
    gtsam = optional.gtsam()
    isam = gtsam.ISAM2(gtsam.ISAM2Params())
    problem = Problem()
    poses = []

    for moment in moments:
        problem.add(moment)
        isam.update(*problem.take_new())
        pose = isam.calculateEstimatePose2(problem.last)
        problem.believe(pose)
        poses.append((pose.x(), pose.y(), pose.theta()))
    return np.array(poses)


class Problem:
    """A factor graph of the poses at the moments and of the landmarks seen.

    Observations weigh by Cauchy's function, so that a landmark taken for another does not count for
    much.
    """

    def __init__(self) -> None:
        self._gtsam = optional.gtsam()
        self._graph = self._gtsam.NonlinearFactorGraph()
        self._start = self._gtsam.Values()
        self._known: set[int] = set()
        self._count = 0
        self._pose = self._gtsam.Pose2(0.0, 0.0, 0.0)

        first = self._key(0)
        fixed = self._gtsam.noiseModel.Constrained.All(3)
        prior = self._gtsam.PriorFactorPose2(first, self._pose, fixed)
        self._start.insert(first, self._pose)
        self._graph.add(prior)

    def add(self, moment: Moment) -> None:
        """Add the next pose, by path integration from the last, and what is seen from it."""
        before = self._key(self._count)
        self._count += 1
        here = self._key(self._count)

        step, sd = step_of(moment.motions)
        motion = self._gtsam.Pose2(*step)
        noise = self._gtsam.noiseModel.Diagonal.Sigmas(sd)
        factor = self._gtsam.BetweenFactorPose2(before, here, motion, noise)
        self._graph.add(factor)

        self._pose = self._pose.compose(motion)
        self._start.insert(here, self._pose)

        for percept in moment.percepts:
            models = self._gtsam.noiseModel
            sds = np.array([percept.bearing_sd_rad, percept.range_sd_m])
            cauchy = models.mEstimator.Cauchy.Create(CAUCHY)
            robust = models.Robust.Create(cauchy, models.Diagonal.Sigmas(sds))

            _, _, number = percept.name.rpartition("-")
            landmark = self._gtsam.symbol("l", int(number))
            bearing = self._gtsam.Rot2(percept.bearing_rad)
            range_m = percept.range_m
            seen = self._gtsam.BearingRangeFactor2D(here, landmark, bearing, range_m, robust)
            self._graph.add(seen)

            if landmark not in self._known:
                self._known.add(landmark)
                direction = np.array([np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)])
                self._start.insert(landmark, self._pose.transformFrom(range_m * direction))

    @property
    def last(self) -> int:
        """Return the key of the newest pose."""
        return self._key(self._count)

    def believe(self, pose: Any) -> None:
        """Let the next pose begin from that one."""
        self._pose = pose

    def take_new(self) -> tuple[Any, Any]:
        """Return the factors and first values since the last call, and forget them."""
        new = self._graph, self._start
        self._graph = self._gtsam.NonlinearFactorGraph()
        self._start = self._gtsam.Values()
        return new

    def solve(self) -> Floats:
        """Solve for the (n, 3) poses, without the start."""
        parameters = self._gtsam.LevenbergMarquardtParams()
        parameters.setMaxIterations(STEPS)
        optimizer = self._gtsam.LevenbergMarquardtOptimizer(self._graph, self._start, parameters)
        keys = [self._key(number) for number in range(1, self._count + 1)]
        return optional.gtsam_poses(optimizer.optimize(), keys)

    def _key(self, number: int) -> int:
        key: int = self._gtsam.symbol("x", number)
        return key


def step_of(rows: Floats) -> tuple[Floats, Floats]:
    """Compute the pose that (n, 5) rows of motion lead to from 0, and its standard deviations."""
    speed, turn_rate, dt, speed_sd, turn_rate_sd = rows.T
    turn_rad = turn_rate * dt
    middle_rad = np.cumsum(turn_rad) - turn_rad / 2
    distance_m = speed * dt

    forwards_m = distance_m * np.cos(middle_rad)
    left_m = distance_m * np.sin(middle_rad)
    step = np.array([forwards_m.sum(), left_m.sum(), turn_rad.sum()])

    # Of sums of independent terms.
    distance_sd_m = np.sqrt(np.square(speed_sd * dt).sum())
    turn_sd_rad = np.sqrt(np.square(turn_rate_sd * dt).sum())
    sds = np.array([distance_sd_m, SIDEWAYS_SHARE * distance_sd_m, turn_sd_rad])
    return step, sds + MIN_SD
