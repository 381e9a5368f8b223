"""What responses reveal of how cues were combined (Nardini et al. 2008)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cogmap.experiments.cue_integration.geometry import CONFLICT_RAD, Point, Points
from cogmap.experiments.cue_integration.trial import Trial
from cogmap.geometry.arrays import Booleans
from cogmap.geometry.se2 import rotate

FAR = 5.0
SHARES = 201
# A response in a hundred may be of a participant who is lost: anywhere in the room.
LOST_SHARE = 0.01
ROOM_M2 = 49.0


def errors(trials: Sequence[Trial], placed: Sequence[Point]) -> Points:
    """Return where the post was put, relative to where it stood: (n, 2) metres, along and inward.

    Along is the direction in which turned landmarks move the target, whether or not they did,
    inward is across it, on the side of post 8: trials of every route, and of landmarks turned
    in either direction, then fall together.
    """
    targets_m = np.array([trial.target for trial in trials])
    offsets_m = np.array(placed) - targets_m

    turned_m = np.array([trial.turned_target for trial in trials])
    shifts_m = turned_m - targets_m
    along = shifts_m / np.hypot(*shifts_m.T)[:, None]
    left = np.column_stack([-along[:, 1], along[:, 0]])
    inward = left * np.array([[trial.side] for trial in trials])
    along_m = (offsets_m * along).sum(axis=1)
    inward_m = (offsets_m * inward).sum(axis=1)
    return np.column_stack([along_m, inward_m])


def turned_errors(errors_m: Points, shift: float) -> Points:
    """Return errors about the target as they are about the turned one, `shift` metres along.

    All is turned by 15°.
    """
    turned_m = rotate(errors_m, CONFLICT_RAD)
    return np.asarray(turned_m + np.array([shift, 0.0]))


def shift_m(trials: Sequence[Trial]) -> float:
    """Return how far turned landmarks move the target."""
    distances_m = []
    for trial in trials:
        distances_m.append(math.dist(trial.turned_target, trial.target))

    return float(np.mean(distances_m))


def sd_m(errors_m: Points) -> float:
    """Return the standard deviation in the plane about the mean of (n, 2) errors."""
    variances_m2 = errors_m.var(axis=0, ddof=1)
    variance_m2 = variances_m2.sum()
    return float(np.sqrt(variance_m2))


def rmse_m(errors_m: Points) -> float:
    """Return the root mean squared distance from where the post stood."""
    squared_m2 = (errors_m**2).sum(axis=1)
    mean_m2 = squared_m2.mean()
    return float(np.sqrt(mean_m2))


def is_lost(errors_m: Points) -> Booleans:
    """Return which (n,) responses lie where no normal distribution has any: FAR times the median
    distance from the median.
    """
    offsets_m = errors_m - np.median(errors_m, axis=0)
    distances_m = np.hypot(*offsets_m.T)

    far_m = FAR * np.median(distances_m)
    return np.asarray(distances_m > far_m)


def robust(log_densities: Points) -> Points:
    """Return the log densities (n,) of responses of which LOST_SHARE are anywhere in the room."""
    kept = np.log(1 - LOST_SHARE) + log_densities
    anywhere = np.log(LOST_SHARE / ROOM_M2)
    return np.asarray(np.logaddexp(kept, anywhere))


def landmark_weight(self_motion_sd_m: float, landmarks_sd_m: float) -> float:
    """Return what landmarks weigh in the optimal combination."""
    self_motion_m2 = self_motion_sd_m**2
    landmarks_m2 = landmarks_sd_m**2
    return self_motion_m2 / (landmarks_m2 + self_motion_m2)


def optimal_sd_m(self_motion_sd_m: float, landmarks_sd_m: float) -> float:
    """Return the standard deviation of the optimal combination of two independent cues."""
    weight = landmark_weight(self_motion_sd_m, landmarks_sd_m)
    by_landmarks_m = weight * landmarks_sd_m
    by_self_motion_m = (1 - weight) * self_motion_sd_m
    return float(np.hypot(by_landmarks_m, by_self_motion_m))


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution in the plane: mean (2,) and covariance (2, 2)."""

    mean_m: Points
    covariance_m2: Points

    @classmethod
    def of(cls, errors_m: Points) -> Gaussian:
        """Fit a normal distribution to (n, 2) errors."""
        mean_m = errors_m.mean(axis=0)
        covariance_m2 = np.cov(errors_m, rowvar=False)
        return cls(mean_m, covariance_m2)

    def log_density(self, points_m: Points) -> Points:
        """Return the log of the density at (n, 2) points."""
        offsets_m = points_m - self.mean_m
        precision = np.linalg.inv(self.covariance_m2)
        mahalanobis2 = np.einsum("ni,ij,nj->n", offsets_m, precision, offsets_m)

        determinant_m4 = np.linalg.det(self.covariance_m2)
        log_norm = np.log(2 * np.pi) + np.log(determinant_m4) / 2
        return np.asarray(-mahalanobis2 / 2 - log_norm)


def combined(first: Gaussian, second: Gaussian) -> Gaussian:
    """Return the optimal combination, direction by direction: precisions add, means weigh by
    them.
    """
    first_precision = np.linalg.inv(first.covariance_m2)
    second_precision = np.linalg.inv(second.covariance_m2)
    precision = first_precision + second_precision
    covariance_m2 = np.linalg.inv(precision)

    first_weighed = first_precision @ first.mean_m
    second_weighed = second_precision @ second.mean_m
    mean_m = covariance_m2 @ (first_weighed + second_weighed)
    return Gaussian(mean_m, covariance_m2)


def alternation_log_densities(
    conflict_m: Points, self_motion: Gaussian, landmarks: Gaussian, landmarks_share: float
) -> Points:
    """Return the log densities (n,) of conflict errors if each response follows one cue alone:
    landmarks in that share.
    """
    shares = [landmarks_share, 1 - landmarks_share]
    with np.errstate(divide="ignore"):
        log_share, log_rest = np.log(shares)

    by_landmarks = log_share + landmarks.log_density(conflict_m)
    by_self_motion = log_rest + self_motion.log_density(conflict_m)

    densities = np.logaddexp(by_landmarks, by_self_motion)
    return np.asarray(densities)


def best_alternation_log_likelihood(
    conflict_m: Points, self_motion: Gaussian, landmarks: Gaussian
) -> float:
    """Return the robust log likelihood of the same, with the share that makes it greatest."""
    likelihoods = []

    for share in np.linspace(0.0, 1.0, SHARES).tolist():
        densities = alternation_log_densities(conflict_m, self_motion, landmarks, share)
        likelihoods.append(float(robust(densities).sum()))

    return max(likelihoods)
