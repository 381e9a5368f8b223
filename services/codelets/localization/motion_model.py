"""What the senses of self-motion and of range are off by: samples of it, beside those of the pose.

Beyond the paper, whose noise is drawn anew at every step: a wheel that slips, slips on, and an eye
that sees everything too near goes on doing so. So each sample of the self holds its own opinion of
that, and those that agree with the landmarks stay, as place cells recalibrate path integration by
landmarks (Jayakumar et al. 2019, doi 10.1038/s41586-019-0939-3).
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.se2 import wrap_angle
from services.codelets.config import Config
from services.codelets.localization.sampling import Samples, standard_normal

POSE_COLUMNS = 3
SPEED = 3
TURN = 4
DRIFT = 5
RANGE = 6
COLUMNS = 7


def spreads(config: Config) -> Samples:
    """Standard deviations (4,) of the gains of speed, turn rate, drift in rad/m, and of range,
    before anything.
    """
    return np.array(
        [config.speed_gain_sd, config.turn_gain_sd, config.drift_rad_per_m, config.range_gain_sd]
    )


def with_gains(samples: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """(n, 7) samples of pose and gains; those of (n, 3) poses are drawn from what is believed
    before anything.
    """
    if samples.shape[1] == COLUMNS:
        return samples
    return np.hstack(
        [samples[:, :POSE_COLUMNS], rng.normal(0.0, 1.0, (len(samples), 4)) * spreads(config)]
    )


def propagate_bias(
    samples: Samples, duration_s: float, config: Config, rng: np.random.Generator
) -> None:
    """Let the gains of (n, 7) samples wander in place, about nothing, as they do in `duration_s`.

    An Ornstein-Uhlenbeck process: its spread stays that of `spreads`, its memory is the configured
    time.
    """
    sds = spreads(config)
    if not duration_s or not sds.any():
        return
    times_s = np.array([config.motion_bias_time_s] * 3 + [config.range_bias_time_s])
    stays = np.exp(-duration_s / times_s)
    fresh = standard_normal(rng, len(samples), 4) * (sds * np.sqrt(1 - stays**2))
    samples[:, POSE_COLUMNS:] = samples[:, POSE_COLUMNS:] * stays + fresh


def move(start: Samples, motions: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """Path integration (paper §5.4): (n, 7) samples after (m, 5) rows of speed, turn rate, duration
    and noise.
    """
    samples = start.copy()
    propagate_bias(samples, float(motions[:, 2].sum()), config, rng)
    speed, turn_rate, _, speed_sd, turn_rate_sd = (column[:, None] for column in motions.T)
    shape = (len(motions), len(samples))
    noisy = (
        speed + speed_sd * standard_normal(rng, *shape),
        turn_rate + turn_rate_sd * standard_normal(rng, *shape),
    )
    _advance(samples, *noisy, motions[:, 2])
    return samples


def dead_reckon(pose: Samples, motions: Samples, gains: Samples) -> Samples:
    """The pose (3,) after (m, 5) rows of motion, without noise, for senses whose gains (4,) are
    known.
    """
    sample = np.concatenate([pose, gains])[None]
    _advance(sample, motions[:, :1], motions[:, 1:2], motions[:, 2])
    after: Samples = sample[0, :POSE_COLUMNS]
    after[2] = wrap_angle(after[2])
    return after


def _advance(samples: Samples, speed: Samples, turn_rate: Samples, dt: Samples) -> None:
    """Move (n, 7) samples in place, by speeds and turn rates (m, n) or (m, 1) that last (m,)."""
    if not len(dt):
        return
    way = speed * dt[:, None] * (1 + samples[:, SPEED])
    turn = turn_rate * dt[:, None] * (1 + samples[:, TURN]) + way * samples[:, DRIFT]
    heading = samples[:, 2] + np.cumsum(turn, axis=0)
    middle = heading - turn / 2
    samples[:, 0] += (way * np.cos(middle)).sum(axis=0)
    samples[:, 1] += (way * np.sin(middle)).sum(axis=0)
    samples[:, 2] = heading[-1]
