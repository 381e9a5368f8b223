"""The motion model: samples of the self moved by path integration (paper §5.4), with the lasting
errors of the senses as part of the state.

Beyond the paper, whose noise is drawn anew at every step: a wheel that slips goes on slipping, and
stereo that sees too near goes on doing so. Each sample of the self holds gains for that, and those
that agree with the landmarks are kept, as place cells recalibrate path integration by landmarks
(Jayakumar et al. 2019, doi 10.1038/s41586-019-0939-3).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cogmap.geometry.se2 import FULL_TURN_RAD
from schemas.nodes import POSE_COLUMNS, SelfColumn
from services.codelets.config import Config
from services.codelets.localization.sampling import Samples, standard_normal

SPEED = SelfColumn.SPEED_GAIN
TURN = SelfColumn.TURN_GAIN
DRIFT = SelfColumn.DRIFT_RAD_PER_M
RANGE = SelfColumn.RANGE_GAIN
COLUMNS = len(SelfColumn)
GAINS = COLUMNS - POSE_COLUMNS


class Bias(NamedTuple):
    """How the senses' gains vary, (4,) each: of speed and turn rate, of drift in rad/m, and of
    range. Their prior standard deviations, and the times in which they change.
    """

    sds: Samples
    times_s: Samples


@lru_cache(maxsize=8)
def bias(config: Config) -> Bias:
    """The gains' variation as configured."""
    sds = [
        config.speed_gain_sd,
        config.turn_gain_sd,
        config.drift_rad_per_m,
        config.range_gain_sd,
    ]
    motion_s = config.motion_bias_time_s
    times_s = [motion_s, motion_s, motion_s, config.range_bias_time_s]
    return Bias(np.array(sds), np.array(times_s))


def with_gains(samples: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """(n, 7) samples of pose and gains; for (n, 3) poses, gains are drawn from their prior."""
    if samples.shape[1] == COLUMNS:
        return np.asfortranarray(samples)

    drawn = rng.normal(0.0, 1.0, (len(samples), GAINS))
    gains = drawn * bias(config).sds
    poses = samples[:, :POSE_COLUMNS]
    return np.hstack([poses, gains])


def propagate_bias(
    samples: Samples, duration_s: float, config: Config, rng: np.random.Generator
) -> None:
    """Let the gains of (n, 7) samples vary in place, as they do in `duration_s`.

    An Ornstein-Uhlenbeck process about 0: its spread stays that of `bias`, its correlation times
    are the configured ones.
    """
    sds, times_s = bias(config)
    if not duration_s or not sds.any():
        return

    remaining = np.exp(-duration_s / times_s)
    innovation_sds = sds * np.sqrt(1 - remaining**2)
    innovations = standard_normal(rng, len(samples), GAINS)
    innovations *= innovation_sds

    gains = samples[:, POSE_COLUMNS:]
    gains *= remaining
    gains += innovations


def move(start: Samples, motions: Samples, config: Config, rng: np.random.Generator) -> Samples:
    """Path integration: (n, 7) samples after (m, 5) rows of speed, turn rate, duration and the
    standard deviations of the two rates.
    """
    samples = start.copy(order="F")
    speed, turn_rate, duration_s, speed_sd, turn_rate_sd = motions.T[:, :, None]
    propagate_bias(samples, float(duration_s.sum()), config, rng)

    shape = (len(samples), len(motions))
    speed_noise = standard_normal(rng, *shape).T
    turn_rate_noise = standard_normal(rng, *shape).T
    noisy_speed = speed + speed_sd * speed_noise
    noisy_turn_rate = turn_rate + turn_rate_sd * turn_rate_noise

    _advance(samples, noisy_speed, noisy_turn_rate, duration_s)
    return samples


def dead_reckon(pose: Samples, motions: Samples, gains: Samples) -> Samples:
    """The pose (3,) after (m, 5) rows of motion without noise, the senses' gains being (4,).

    As `move` without noise, but number by number: arrays of one pose take twenty times as long.
    """
    x_m, y_m, heading_rad = pose.tolist()
    speed_gain, turn_gain, drift_rad_per_m, _ = gains.tolist()

    for speed, turn_rate, duration_s, *_ in motions.tolist():
        distance_m = speed * duration_s * (1 + speed_gain)
        turn_rad = turn_rate * duration_s * (1 + turn_gain)
        turn_rad += distance_m * drift_rad_per_m

        middle_rad = heading_rad + turn_rad / 2
        x_m += distance_m * math.cos(middle_rad)
        y_m += distance_m * math.sin(middle_rad)
        heading_rad += turn_rad

    heading_rad = math.remainder(heading_rad, FULL_TURN_RAD)
    return np.array([x_m, y_m, heading_rad])


def _advance(samples: Samples, speed: Samples, turn_rate: Samples, duration_s: Samples) -> None:
    """Move (n, 7) samples in place, by speeds and turn rates (m, n) that last (m, 1) seconds, each
    along the heading half-way through its turn.
    """
    if not len(duration_s):
        return

    distance = speed * duration_s
    distance *= 1 + samples[:, SPEED]
    turn = turn_rate * duration_s
    turn *= 1 + samples[:, TURN]
    turn += distance * samples[:, DRIFT]

    heading = samples[:, 2] + turn
    for row in range(1, len(turn)):
        heading[row] = heading[row - 1] + turn[row]

    turn /= 2
    middle = np.subtract(heading, turn, out=turn)
    east = distance * np.cos(middle)
    north = distance * np.sin(middle)
    samples[:, 0] += east.sum(axis=0)
    samples[:, 1] += north.sum(axis=0)
    samples[:, 2] = heading[-1]
