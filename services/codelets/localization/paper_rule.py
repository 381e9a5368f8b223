"""Localization as the paper prints it (§5.4, eq. 1-4, table 1): pure functions of samples.

The samples of a step start from the mean of those before. Each is kept with the likelihood of all
views at it, relative to that of a perfect match, and nothing else is done to it. If none is kept,
the samples before the view stay: the views contradict what self-motion has left possible, and the
paper has no rule for that.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, wrap_angle
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization.measurement_model import Measurements, compare
from cogmap.services.codelets.localization.motion_model import COLUMNS, move
from cogmap.services.codelets.localization.sampling import resample

# Of a self-motion's five numbers: its rates and their standard deviations.
RATES = (0, 1)
RATE_SDS = (3, 4)


def moved(samples: Floats, motions: Floats, config: Config, rng: np.random.Generator) -> Floats:
    """Move `config.samples` samples (n, 7), without gains, from the mean pose of those before,
    (k, 3) or more columns, by (m, 5) motions.

    s_i = mean(s) + T(v dt N(1, diag(sigma_v^2, sigma_w^2))): sigma_v and sigma_w are what the sense
    states of its noise, as shares of the rate; a rate of 0 has no noise. Each reading of the sense
    has noise of its own.
    """
    start = np.zeros((config.samples, COLUMNS))
    start[:, :3] = mean_pose(samples)

    multiplied = motions.copy()
    for rate, sd in zip(RATES, RATE_SDS, strict=True):
        multiplied[motions[:, rate] == 0, sd] = 0.0
    return move(start, multiplied, Config(), rng)


def corrected(
    samples: Floats, seen: Measurements, rng: np.random.Generator
) -> tuple[Floats, float]:
    """Reject (n, 7) samples by the product of p(l_j | o_j, x) over the landmarks in view (eq. 2).
    Return those that are kept, and the share of all that they are: 0 if none is, and all stay.

    The distribution of a landmark's own position widens that of its view.
    """
    squared = compare(samples, seen).squared.sum(axis=0)
    return _kept(samples, squared.astype(np.float64), rng)


def landmark(
    positions_m: Floats, pose: Floats, percept: Percept, rng: np.random.Generator
) -> tuple[Floats, float]:
    """Reject (n, 2) samples of a landmark's position by p(o | l, x), seen from `pose` (3,) (eq. 4).
    Return as many as before, those that are kept repeated, and the share that is kept: 0 if none
    is, and all stay.
    """
    squared = np.zeros(len(positions_m))
    offset_m = positions_m - pose[:2]
    if percept.has_bearing:
        bearing_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0]) - pose[2]
        residual_rad = wrap_angle(bearing_rad - percept.bearing_rad)
        squared += (residual_rad / percept.bearing_sd_rad) ** 2
    if percept.has_range:
        residual_m = np.hypot(offset_m[:, 0], offset_m[:, 1]) - percept.range_m
        squared += (residual_m / percept.range_sd_m) ** 2

    kept_m, share = _kept(positions_m, squared, rng)
    return resample(kept_m, len(positions_m), 0.0, rng), share


def _kept(samples: Floats, squared: Floats, rng: np.random.Generator) -> tuple[Floats, float]:
    """Keep each of (n, d) samples with probability exp(-squared / 2), all if none is kept; return
    the share that is kept.
    """
    is_kept = rng.random(len(samples)) < np.exp(-squared / 2)
    if not is_kept.any():
        return samples, 0.0
    return samples[is_kept], float(is_kept.mean())
