"""The peers of mapping, gtsam's: a batch smoother, which gets the whole log at once, and iSAM2,
which estimates each pose when it is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks import optional
from benchmarks.localization.loop import DRIFT_RAD_PER_M, SPEED, TURN
from benchmarks.localization.particle_filter import SCALES
from benchmarks.localization.senses import Moment
from cogmap.geometry.arrays import Floats

STEPS = 100
MIN_SD = 1e-4
SIDEWAYS_SHARE = 0.2
CAUCHY = 2.0


class Noise(NamedTuple):
    """What is assumed of motion and observations: factors of the standard deviations that they
    state, and the least variances of a step by its length in m and its turn in rad.
    """

    motion: float = 1.0
    observation: float = 1.0
    path_variance_per_m: float = 0.0
    heading_variance_per_m: float = 0.0
    heading_variance_per_rad: float = 0.0


STATED = Noise()
# The rule and the constants by which our maps are corrected.
OURS = Noise(1.0, 1.0, SPEED**2, DRIFT_RAD_PER_M**2, TURN**2)
# The one with the least error on the robots themselves is reported, in gtsam's favour.
NOISES = (*(Noise(*scales) for scales in SCALES), OURS)


def smooth(moments: Sequence[Moment], noise: Noise = STATED) -> Floats:
    """Return (n, 3) poses at the moments that fit all percepts and motions best; the start is at 0.

    Levenberg-Marquardt on the same percepts and motions that the codelets get; landmarks are
    unknown. Raises UsageError if gtsam is not installed.
    """
    problem = Problem(noise)

    for moment in moments:
        problem.add(moment)

    return problem.poses(problem.solve())


def smooth_online(moments: Sequence[Moment], noise: Noise = STATED) -> Floats:
    """Return (n, 3) poses, each as iSAM2 (Kaess et al. 2012) has it at its own moment; the start is
    at 0.

    On the same factors as `smooth`. Raises UsageError if gtsam is not installed.
    """
    gtsam = optional.gtsam()
    isam = gtsam.ISAM2(gtsam.ISAM2Params())
    problem = Problem(noise)
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

    If it `is_robust`, observations weigh by Cauchy's function, so that a landmark taken for another
    does not count for much.
    """

    def __init__(self, noise: Noise = STATED, is_robust: bool = True) -> None:
        self._noise = noise
        self._is_robust = is_robust
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
        sd = with_noise(step, sd, self._noise)
        sigmas = self._gtsam.noiseModel.Diagonal.Sigmas(sd)
        factor = self._gtsam.BetweenFactorPose2(before, here, motion, sigmas)
        self._graph.add(factor)

        self._pose = self._pose.compose(motion)
        self._start.insert(here, self._pose)

        for percept in moment.percepts:
            stated = np.array([percept.bearing_sd_rad, percept.range_sd_m])
            noise = self._observed(self._noise.observation * stated)

            _, _, number = percept.name.rpartition("-")
            landmark = self._gtsam.symbol("l", int(number))
            bearing = self._gtsam.Rot2(percept.bearing_rad)
            range_m = percept.range_m
            seen = self._gtsam.BearingRangeFactor2D(here, landmark, bearing, range_m, noise)
            self._graph.add(seen)

            if landmark not in self._known:
                self._known.add(landmark)
                direction = np.array([np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)])
                self._start.insert(landmark, self._pose.transformFrom(range_m * direction))

    def add_match(self, number: int, sds: Sequence[float]) -> None:
        """Add that the newest pose is that of the pose `number`, from 1 on, with standard
        deviations of x_m, y_m and heading_rad.
        """
        nowhere = self._gtsam.Pose2(0.0, 0.0, 0.0)
        noise = self._observed(np.array(sds))
        before = self._key(number)
        self._graph.add(self._gtsam.BetweenFactorPose2(before, self.last, nowhere, noise))

    def _observed(self, sds: Floats) -> Any:
        """Return the noise of an observation with these standard deviations."""
        models = self._gtsam.noiseModel
        normal = models.Diagonal.Sigmas(sds)
        if not self._is_robust:
            return normal

        cauchy = models.mEstimator.Cauchy.Create(CAUCHY)
        return models.Robust.Create(cauchy, normal)

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

    def solve(self, start: Any = None) -> Any:
        """Solve for gtsam's values, from those of `start`, by path integration without it."""
        first = self._start if start is None else start
        parameters = self._gtsam.LevenbergMarquardtParams()
        parameters.setMaxIterations(STEPS)
        return self._gtsam.LevenbergMarquardtOptimizer(self._graph, first, parameters).optimize()

    def cost(self, values: Any) -> float:
        """Return half of the weighed sum of squares that `solve` makes least."""
        return float(self._graph.error(values))

    def poses(self, values: Any) -> Floats:
        """Return the (n, 3) poses, without the start."""
        keys = [self._key(number) for number in range(1, self._count + 1)]
        return optional.gtsam_poses(values, keys)

    def landmark_m(self, values: Any, number: int) -> Floats:
        """Return where a landmark is, (2,); NaN for one that was never seen."""
        landmark = self._gtsam.symbol("l", number)
        if landmark not in self._known:
            return np.full(2, np.nan)

        position_m: Floats = values.atPoint2(landmark)
        return position_m

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


def with_noise(step: Floats, sds: Floats, noise: Noise) -> Floats:
    """Return the standard deviations (3,) of a step that states `sds`, by `noise`."""
    length_m = float(np.hypot(*step[:2]))
    least_m2 = noise.path_variance_per_m * length_m
    least_rad2 = noise.heading_variance_per_m * length_m
    least_rad2 += noise.heading_variance_per_rad * abs(float(step[2]))
    least = np.sqrt([least_m2, SIDEWAYS_SHARE**2 * least_m2, least_rad2])
    return np.asarray(np.maximum(noise.motion * sds, least))
