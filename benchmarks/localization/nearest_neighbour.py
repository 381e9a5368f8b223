"""The peer of mapping without names: gtsam's incremental smoother (iSAM2), which takes each percept
for the landmark that is nearest to it.

Nearest is by the Mahalanobis distance, in the covariance of the pose and the landmarks together;
the two gates are those that are usual for Victoria Park: a landmark within one is the percept's,
one beyond the other is new, and what lies between is left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from benchmarks import optional
from benchmarks.localization.senses import Moment
from benchmarks.localization.smoother import CAUCHY, step_of
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, wrap_angle
from cogmap.schemas.sensing import Percept

# Bailey's for Victoria Park: of squared Mahalanobis distances.
SAME_BELOW = 5.0
NEW_ABOVE = 25.0
# Landmarks farther from where a percept seems to be are not compared with it.
NEAR_M = 6.0
# Beyond the reach of the laser.
FARTHEST_M = 100.0
FINAL_UPDATES = 5


class NearestNeighbour:
    """The smoother as it goes along: poses at the moments, from the origin, and landmarks."""

    def __init__(self) -> None:
        self._gtsam = optional.gtsam()
        self._isam = self._gtsam.ISAM2()
        self._count = 0
        self._pose = np.zeros(3)
        self._landmarks_m = np.zeros((0, 2))

        graph = self._gtsam.NonlinearFactorGraph()
        values = self._gtsam.Values()
        fixed = self._gtsam.noiseModel.Isotropic.Sigma(3, 1e-6)
        origin = self._gtsam.Pose2(0.0, 0.0, 0.0)
        graph.add(self._gtsam.PriorFactorPose2(self._pose_key(0), origin, fixed))
        values.insert(self._pose_key(0), origin)
        self._isam.update(graph, values)

    @property
    def landmarks(self) -> int:
        """Return how many landmarks there are."""
        return len(self._landmarks_m)

    def add(self, moment: Moment) -> None:
        """Add the next pose, and what is seen from it."""
        before = self._pose_key(self._count)
        self._count += 1
        here = self._pose_key(self._count)

        step, sds = step_of(moment.motions)
        graph = self._gtsam.NonlinearFactorGraph()
        values = self._gtsam.Values()
        noise = self._gtsam.noiseModel.Diagonal.Sigmas(sds)
        motion = self._gtsam.Pose2(*step)
        graph.add(self._gtsam.BetweenFactorPose2(before, here, motion, noise))
        pose = compose(self._pose, step)
        values.insert(here, self._gtsam.Pose2(*pose))
        if not moment.percepts:
            self._isam.update(graph, values)
            self._pose = pose
            return

        for percept, number in zip(
            moment.percepts, self._associated(pose, step, sds, moment.percepts), strict=True
        ):
            if number is None:
                continue

            landmark = self._gtsam.symbol("l", number)
            graph.add(self._factor(here, landmark, percept))
            if number == len(self._landmarks_m):
                position_m = _position_m(pose, percept)
                values.insert(landmark, position_m)
                self._landmarks_m = np.vstack([self._landmarks_m, position_m])

        self._isam.update(graph, values)
        found = self._isam.calculateEstimatePose2(here)
        self._pose = np.array([found.x(), found.y(), found.theta()])
        self._update_landmarks()

    def path(self) -> Floats:
        """Return the (n, 3) poses at the moments, by all that was seen."""
        for _ in range(FINAL_UPDATES):
            self._isam.update()
        values = self._isam.calculateBestEstimate()
        keys = [self._pose_key(number) for number in range(1, self._count + 1)]
        return optional.gtsam_poses(values, keys)

    def _update_landmarks(self) -> None:
        """Take the landmarks near the robot where they are now."""
        away_m = np.hypot(*(self._landmarks_m - self._pose[:2]).T)
        for number in np.flatnonzero(away_m < FARTHEST_M).tolist():
            key = self._gtsam.symbol("l", number)
            self._landmarks_m[number] = self._isam.calculateEstimatePoint2(key)

    def _associated(
        self, pose: Floats, step: Floats, sds: Floats, percepts: Iterable[Percept]
    ) -> list[int | None]:
        """Return the number of each percept's landmark, that of a new one, or None."""
        seen_m = np.array([_position_m(pose, percept) for percept in percepts])
        distances_m = np.hypot(*(self._landmarks_m[None] - seen_m[:, None]).T).T
        near = np.flatnonzero((distances_m < NEAR_M).any(axis=0))
        joint = self._joint_covariance(near, step, sds)

        pairs = []
        nearest = np.full(len(seen_m), np.inf)
        for row, percept in enumerate(percepts):
            for column, number in enumerate(near.tolist()):
                if distances_m[row, number] >= NEAR_M:
                    continue
                squared = self._mahalanobis2(pose, number, column, joint, percept)
                nearest[row] = min(nearest[row], squared)
                pairs.append((squared, row, number))

        chosen: list[int | None] = [None] * len(seen_m)
        taken = set()
        for squared, row, number in sorted(pairs):
            if squared < SAME_BELOW and chosen[row] is None and number not in taken:
                chosen[row] = number
                taken.add(number)

        following = len(self._landmarks_m)
        for row in np.flatnonzero(nearest > NEW_ABOVE).tolist():
            chosen[row] = following
            following += 1
        return chosen

    def _joint_covariance(self, near: Any, step: Floats, sds: Floats) -> Floats:
        """Compute the covariance (3 + 2 k,) squared of the next pose and the landmarks `near`."""
        size = 3 + 2 * len(near)
        covariance = np.zeros((size, size))
        before = self._pose_key(self._count - 1)
        if len(near):
            keys = [self._gtsam.symbol("l", number) for number in near.tolist()]
            marginal = self._isam.jointMarginalCovariance(self._gtsam.KeyVector([*keys, before]))
            blocks = [(before, slice(0, 3))]
            for column, key in enumerate(keys):
                blocks.append((key, slice(3 + 2 * column, 5 + 2 * column)))
            for first, rows in blocks:
                for second, columns in blocks:
                    covariance[rows, columns] = marginal.at(first, second)
        else:
            covariance[:3, :3] = self._isam.marginalCovariance(before)

        # In the frames of the poses, as gtsam's are.
        motion = self._gtsam.Pose2(*step)
        carried = np.eye(size)
        carried[:3, :3] = motion.inverse().AdjointMap()
        covariance = carried @ covariance @ carried.T
        covariance[:3, :3] += np.diag(sds**2)
        return covariance

    def _mahalanobis2(
        self, pose: Floats, number: int, column: int, joint: Floats, percept: Percept
    ) -> float:
        offset_m = self._landmarks_m[number] - pose[:2]
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        ahead_m, left_m = np.array([[cosine, sine], [-sine, cosine]]) @ offset_m
        squared_m2 = max(ahead_m**2 + left_m**2, 1e-6)
        range_m = np.sqrt(squared_m2)

        by_place = np.array(
            [[ahead_m / range_m, left_m / range_m], [-left_m / squared_m2, ahead_m / squared_m2]]
        )
        by_pose = np.hstack([-by_place, [[0.0], [-1.0]]])
        by_landmark = by_place @ np.array([[cosine, sine], [-sine, cosine]])
        jacobian = np.hstack([by_pose, by_landmark])

        at = [0, 1, 2, 3 + 2 * column, 4 + 2 * column]
        covariance = jacobian @ joint[np.ix_(at, at)] @ jacobian.T
        covariance += np.diag([percept.range_sd_m**2, percept.bearing_sd_rad**2])
        turned_rad = percept.bearing_rad - np.arctan2(left_m, ahead_m)
        residual = np.array([percept.range_m - range_m, wrap_angle(turned_rad)])
        return float(residual @ np.linalg.solve(covariance, residual))

    def _factor(self, here: int, landmark: int, percept: Percept) -> Any:
        models = self._gtsam.noiseModel
        sds = np.array([percept.bearing_sd_rad, percept.range_sd_m])
        cauchy = models.mEstimator.Cauchy.Create(CAUCHY)
        robust = models.Robust.Create(cauchy, models.Diagonal.Sigmas(sds))
        bearing = self._gtsam.Rot2(percept.bearing_rad)
        return self._gtsam.BearingRangeFactor2D(here, landmark, bearing, percept.range_m, robust)

    def _pose_key(self, number: int) -> Any:
        return self._gtsam.symbol("x", number)


def _position_m(pose: Floats, percept: Percept) -> Floats:
    """Return where a percept stands as seen from a pose."""
    direction_rad = pose[2] + percept.bearing_rad
    direction = np.array([np.cos(direction_rad), np.sin(direction_rad)])
    position_m: Floats = pose[:2] + percept.range_m * direction
    return position_m
