"""Distributions as samples: moving them, keeping some, telling their mean and spread (paper §5.4)."""

from __future__ import annotations

import hashlib

import numpy as np
import numpy.typing as npt

Samples = npt.NDArray[np.float64]


def generator(identifier: str) -> np.random.Generator:
    """Randomness that depends on what is being computed alone, so that every worker computes the same."""
    return np.random.default_rng(int.from_bytes(hashlib.blake2b(identifier.encode(), digest_size=8).digest()))


def wrapped(angle_rad: Samples) -> Samples:
    """Angles in (-pi, pi]."""
    result: Samples = np.pi - (np.pi - angle_rad) % (2 * np.pi)
    return result


def mean_pose(poses: Samples) -> Samples:
    """The mean of (n, 3) samples x_m, y_m, heading_rad, the heading's on the circle."""
    heading = np.arctan2(np.sin(poses[:, 2]).mean(), np.cos(poses[:, 2]).mean())
    return np.array([poses[:, 0].mean(), poses[:, 1].mean(), heading])


def spread(samples: Samples, mean: Samples) -> Samples:
    """Standard deviation of each column about `mean`; a third column is a heading."""
    off = samples - mean
    if samples.shape[1] == 3:
        off[:, 2] = wrapped(off[:, 2])
    sd: Samples = np.sqrt((off**2).mean(axis=0))
    return sd


def keep(log_likelihood: Samples, rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Rejection sampling: each sample stays with a probability proportional to its likelihood.

    The likeliest always stays, so that something does even where all are unlikely.
    """
    relative = np.exp(log_likelihood - log_likelihood.max())
    kept: npt.NDArray[np.bool_] = rng.random(len(relative)) < relative
    kept[int(np.argmax(relative))] = True
    return kept


def refill(kept: Samples, number: int, jitter: float | Samples, rng: np.random.Generator) -> Samples:
    """`number` samples drawn from those kept, each moved a little so that none stands for many."""
    chosen = kept[rng.integers(len(kept), size=number)]
    moved: Samples = chosen + rng.normal(0.0, 1.0, chosen.shape) * jitter
    return moved
