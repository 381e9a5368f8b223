"""What responses say about how cues were combined (Nardini et al. 2008)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cue_integration.geometry import CONFLICT_RAD, Points
from experiments.cue_integration.trial import Response, Trial

FAR = 5.0


def errors(trials: Sequence[Trial], responses: Sequence[Response]) -> Points:
    """Where the post was put, seen from where it stood: (n, 2) metres, along and inward.

    Along is the way that turned landmarks move the target, whether or not they did, inward is
    across it, on the side of post 8: trials of every route, and of landmarks turned either way,
    then fall together.
    """
    targets = np.array([trial.target for trial in trials])
    moved = np.array([trial.turned_target for trial in trials]) - targets
    along = moved / np.hypot(*moved.T)[:, None]
    inward = np.column_stack([-along[:, 1], along[:, 0]]) * np.array(
        [[trial.side] for trial in trials]
    )
    off = np.array([(response.x_m, response.y_m) for response in responses]) - targets
    return np.column_stack([(off * along).sum(axis=1), (off * inward).sum(axis=1)])


def turned_errors(errors_m: Points, shift: float) -> Points:
    """Errors about the target as they are about the turned one, `shift` metres along: turned by 15°
    with all else.
    """
    cos = math.cos(CONFLICT_RAD)
    sin = math.sin(CONFLICT_RAD)
    turned: Points = errors_m @ np.array([[cos, sin], [-sin, cos]]) + np.array([shift, 0.0])
    return turned


def shift_m(trials: Sequence[Trial]) -> float:
    """How far turned landmarks move the target."""
    return float(
        np.mean([np.hypot(*(np.array(trial.turned_target) - trial.target)) for trial in trials])
    )


def sd_m(errors_m: Points) -> float:
    """The standard deviation in the plane about the mean of (n, 2) errors."""
    return float(np.sqrt(errors_m.var(axis=0, ddof=1).sum()))


def rmse_m(errors_m: Points) -> float:
    """The root mean squared distance from where the post stood."""
    return float(np.sqrt((errors_m**2).sum(axis=1).mean()))


def lost(errors_m: Points) -> int:
    """How many responses lie where no normal distribution has any: five times the median distance
    from the median.
    """
    away_m = np.hypot(*(errors_m - np.median(errors_m, axis=0)).T)
    return int((away_m > FAR * np.median(away_m)).sum())


def landmark_weight(self_motion_sd_m: float, landmarks_sd_m: float) -> float:
    """What landmarks weigh in the optimal combination."""
    return self_motion_sd_m**2 / (landmarks_sd_m**2 + self_motion_sd_m**2)


def optimal_sd_m(self_motion_sd_m: float, landmarks_sd_m: float) -> float:
    """The standard deviation of the optimal combination of two independent cues."""
    weight = landmark_weight(self_motion_sd_m, landmarks_sd_m)
    return float(np.hypot(weight * landmarks_sd_m, (1 - weight) * self_motion_sd_m))


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution in the plane: mean (2,) and covariance (2, 2)."""

    mean_m: Points
    covariance_m2: Points

    @classmethod
    def of(cls, errors_m: Points) -> Gaussian:
        """As (n, 2) errors are distributed."""
        return cls(errors_m.mean(axis=0), np.cov(errors_m, rowvar=False))

    def log_density(self, points_m: Points) -> Points:
        """The log of the density at (n, 2) points."""
        off = points_m - self.mean_m
        squared = np.einsum("ni,ij,nj->n", off, np.linalg.inv(self.covariance_m2), off)
        result: Points = (
            -squared / 2 - np.log(2 * np.pi) - np.log(np.linalg.det(self.covariance_m2)) / 2
        )
        return result


def combined(first: Gaussian, second: Gaussian) -> Gaussian:
    """The optimal combination, direction by direction: precisions add, means weigh by them."""
    precisions = [np.linalg.inv(each.covariance_m2) for each in (first, second)]
    covariance = np.linalg.inv(precisions[0] + precisions[1])
    return Gaussian(
        covariance @ (precisions[0] @ first.mean_m + precisions[1] @ second.mean_m), covariance
    )


def alternation_log_densities(
    conflict_m: Points, self_motion: Gaussian, landmarks: Gaussian, landmarks_share: float
) -> Points:
    """The log densities (n,) of conflict errors where each response follows one cue alone:
    landmarks in that share.
    """
    with np.errstate(divide="ignore"):
        shares = np.log([landmarks_share, 1 - landmarks_share])
    followed: Points = np.logaddexp(
        shares[0] + landmarks.log_density(conflict_m),
        shares[1] + self_motion.log_density(conflict_m),
    )
    return followed


def best_alternation_log_likelihood(
    conflict_m: Points, self_motion: Gaussian, landmarks: Gaussian
) -> float:
    """The same, with the share that makes it most."""
    shares = np.linspace(0.0, 1.0, 201)
    return max(
        float(alternation_log_densities(conflict_m, self_motion, landmarks, float(share)).sum())
        for share in shares
    )
