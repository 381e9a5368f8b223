"""The motion model: samples of the self moved by path integration (paper §5.4), with the lasting
errors of the senses as part of the state.

Beyond the paper, whose noise is drawn anew at every step: a wheel slips for some seconds, stereo
sees too near for minutes. Each sample of the self holds gains for that, and those that agree with
the landmarks are kept, as place cells recalibrate path integration by landmarks (Jayakumar et al.
2019, doi 10.1038/s41586-019-0939-3).
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.se2 import wrap_angle
from cogmap.schemas.nodes import POSE_COLUMNS, SelfColumn
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.localization.sampling import Samples, standard_normal

SPEED = SelfColumn.SPEED_GAIN
TURN = SelfColumn.TURN_GAIN
DRIFT = SelfColumn.DRIFT_RAD_PER_M
RANGE = SelfColumn.RANGE_GAIN
COLUMNS = len(SelfColumn)
GAINS = COLUMNS - POSE_COLUMNS
# Correlation times of the lasting errors: wheels slip for seconds, stereo errs for minutes.
MOTION_BIAS_TIME_S = 30.0
RANGE_BIAS_TIME_S = 300.0


def gain_sds(config: Config) -> Samples:
    """Return the (4,) prior standard deviations of the gains of speed and turn rate, of drift in
    rad/m, and of the gain of range.
    """
    return np.array(
        [config.speed_gain_sd, config.turn_gain_sd, config.drift_rad_per_m, config.range_gain_sd]
    )


def with_gains(samples: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """Return (n, 7) samples of pose and gains; draw the gains of (n, 3) poses from their prior."""
    if samples.shape[1] == COLUMNS:
        return samples
    gains = rng.normal(0.0, 1.0, (len(samples), GAINS)) * gain_sds(config)
    return np.hstack([samples[:, :POSE_COLUMNS], gains])


def propagate_bias(
    samples: Samples, duration_s: float, config: Config, rng: np.random.Generator
) -> None:
    """Let the gains of (n, 7) samples vary in place, as they do in `duration_s`.

    An Ornstein-Uhlenbeck process about 0: its spread stays that of `gain_sds`.
    """
    sds = gain_sds(config)
    if not duration_s or not sds.any():
        return

    motion_s = MOTION_BIAS_TIME_S
    times_s = np.array([motion_s, motion_s, motion_s, RANGE_BIAS_TIME_S])

    remaining = np.exp(-duration_s / times_s)
    innovation_sds = sds * np.sqrt(1 - remaining**2)
    innovations = standard_normal(rng, len(samples), GAINS) * innovation_sds
    samples[:, POSE_COLUMNS:] = samples[:, POSE_COLUMNS:] * remaining + innovations


def move(start: Samples, motions: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """Integrate the path of (n, 7) samples over (m, 5) rows of speed, turn rate, duration and the
    standard deviations of the two rates.
    """
    samples = start.copy()
    propagate_bias(samples, float(motions[:, 2].sum()), config, rng)

    speed, turn_rate, _, speed_sd, turn_rate_sd = (column[:, None] for column in motions.T)
    shape = (len(motions), len(samples))
    noisy_speed = speed + speed_sd * standard_normal(rng, *shape)
    noisy_turn_rate = turn_rate + turn_rate_sd * standard_normal(rng, *shape)
    _advance(samples, noisy_speed, noisy_turn_rate, motions[:, 2])
    return samples


def dead_reckon(pose: Samples, motions: Samples, gains: Samples) -> Samples:
    """Compute the pose (3,) after (m, 5) motions without noise, by the senses' `gains`, (4,)."""
    sample = np.concatenate([pose, gains])[None]
    _advance(sample, motions[:, :1], motions[:, 1:2], motions[:, 2])
    after: Samples = sample[0, :POSE_COLUMNS]
    after[2] = wrap_angle(after[2])
    return after


def _advance(samples: Samples, speed: Samples, turn_rate: Samples, duration_s: Samples) -> None:
    """Move (n, 7) samples in place, by speeds and turn rates (m, n) or (m, 1) that last (m,)
    seconds, each along the heading half-way through its turn.
    """
    if not len(duration_s):
        return
    distance = speed * duration_s[:, None] * (1 + samples[:, SPEED])
    turn = turn_rate * duration_s[:, None] * (1 + samples[:, TURN])
    turn = turn + distance * samples[:, DRIFT]

    heading = samples[:, 2] + np.cumsum(turn, axis=0)
    middle = heading - turn / 2
    samples[:, 0] += (distance * np.cos(middle)).sum(axis=0)
    samples[:, 1] += (distance * np.sin(middle)).sum(axis=0)
    samples[:, 2] = heading[-1]
