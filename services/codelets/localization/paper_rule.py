"""Localization as the paper prints it (§5.4, eq. 1-4, table 1): pure functions of samples.

The samples of a step start from the mean of those before. Each is kept with a probability in
proportion to the likelihood of all views there, 1 for the likeliest, and nothing else is done to
it. If all likelihoods are 0 in double precision, no sample is left, and those before the view stay:
the views contradict what self-motion has left possible, and the paper has no rule for that.
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


def moved(samples: Floats, motions: Floats, config: Config, rng: np.random.Generator) -> Floats:
    """Move `config.samples` samples (n, 7), without gains, from the mean pose of those before,
    (k, 3) or more columns, by (m, 5) motions.

    s_i = mean(s) + T(v dt N(1, diag(sigma_v^2, sigma_w^2))): a factor with a mean of one adds to a
    rate noise of sigma times the rate, and that is what the sense states of each reading. (One that
    was not felt at all has a deviation, though it is 0: a disoriented agent's turn.)
    """
    start = np.zeros((config.samples, COLUMNS))
    start[:, :3] = mean_pose(samples)

    return move(start, motions, Config(), rng)


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
    positions_m: Floats, selves: Floats, percept: Percept, rng: np.random.Generator
) -> tuple[Floats, float]:
    """Reject (n, 2) samples of a landmark's position by p(o | l, x), each seen from one of (k, 3 or
    more) samples of the self, drawn at random (eq. 4). Return as many as before, those that are
    kept repeated, and the share that is kept: 0 if none is, and all stay.
    """
    squared = np.zeros(len(positions_m))
    poses = selves[rng.integers(len(selves), size=len(positions_m))]
    offset_m = positions_m - poses[:, :2]
    if percept.has_bearing:
        bearing_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0]) - poses[:, 2]
        residual_rad = wrap_angle(bearing_rad - percept.bearing_rad)
        squared += (residual_rad / percept.bearing_sd_rad) ** 2
    if percept.has_range:
        residual_m = np.hypot(offset_m[:, 0], offset_m[:, 1]) - percept.range_m
        squared += (residual_m / percept.range_sd_m) ** 2

    kept_m, share = _kept(positions_m, squared, rng)
    return resample(kept_m, len(positions_m), 0.0, rng), share


def _kept(samples: Floats, squared: Floats, rng: np.random.Generator) -> tuple[Floats, float]:
    """Keep each of (n, d) samples with its likelihood exp(-squared / 2) over that of the likeliest;
    return the share that is kept. All stay, and the share is 0, if each likelihood is 0 in double
    precision.
    """
    likelihood = np.exp(-squared / 2)
    largest = float(likelihood.max())
    if largest == 0.0:
        return samples, 0.0

    is_kept = rng.random(len(samples)) * largest < likelihood
    return samples[is_kept], float(is_kept.mean())
