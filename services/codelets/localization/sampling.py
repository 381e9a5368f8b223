"""Distributions as samples: moving them, keeping some, telling their mean and spread (paper §5.4)."""

from __future__ import annotations

import hashlib

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import mean_pose, wrap_angle

Samples = Floats
STRAIGHTS = 4
TURN = 2 * np.pi
# How far samples that are all the same are spread where they must be: metres, metres, radians.
HEAP = np.array([0.02, 0.02, 0.01])


def generator(identifier: str) -> np.random.Generator:
    """Randomness that depends on what is being computed alone, so that every worker computes the
    same.
    """
    return np.random.default_rng(
        int.from_bytes(hashlib.blake2b(identifier.encode(), digest_size=8).digest())
    )


def standard_normal(rng: np.random.Generator, *shape: int) -> Samples:
    """Standard normal numbers, of single precision: they cost half, and noise needs no more."""
    return rng.standard_normal(shape, np.float32).astype(np.float64)


def centred(samples: Samples) -> tuple[Samples, Samples]:
    """The mean (d,) of (n, d) samples and how far each is off it; of three columns or more the
    third is a heading.
    """
    number, columns = samples.shape
    average = np.full(number, 1 / number)
    mean = average @ samples
    if columns > 2:
        heading = np.ascontiguousarray(samples[:, 2])
        mean[2] = np.arctan2(average @ np.sin(heading), average @ np.cos(heading))
    off = samples - mean
    if columns > 2:
        off[:, 2] -= TURN * np.rint(off[:, 2] / TURN)
    return mean, off


def spread(samples: Samples, mean: Samples) -> Samples:
    """Standard deviation of each column about `mean`; a third column is a heading."""
    off = samples - mean
    if samples.shape[1] == 3:
        off[:, 2] = wrap_angle(off[:, 2])
    sd: Samples = np.sqrt((off**2).mean(axis=0))
    return sd


def rejection_mask(log_likelihood: Samples, rng: np.random.Generator) -> Booleans:
    """Rejection sampling: each sample stays with a probability proportional to its likelihood.

    The likeliest always stays, so that something does even where all are unlikely.
    """
    relative = np.exp(log_likelihood - log_likelihood.max())
    kept: Booleans = rng.random(len(relative)) < relative
    kept[int(np.argmax(relative))] = True
    return kept


def inflate(poses: Samples, factor: float, rng: np.random.Generator) -> Samples:
    """Samples whose first three columns are `factor` times as far about their mean, and those of a
    heap a little.
    """
    result = poses.copy()
    mean = mean_pose(poses)
    off = poses[:, :3] - mean
    off[:, 2] = wrap_angle(off[:, 2])
    result[:, :3] = mean + factor * off + rng.normal(0.0, 1.0, off.shape) * HEAP
    return result


def kernel_smooth(drawn: Samples, tell_apart: float, rng: np.random.Generator) -> Samples:
    """Samples in place of `drawn`, in which few stand for many, with the same mean and covariance.

    A Gaussian kernel as wide as Silverman's rule has it for `tell_apart` samples, shrunk to the
    mean by as much (Liu and West 2001). The third column may be a heading: it is taken on the
    circle.
    """
    number, columns = drawn.shape
    mean, off = centred(drawn)
    width2 = min(0.9, (4 / ((columns + 2) * max(1.0, tell_apart))) ** (2 / (columns + 4)))
    values, vectors = np.linalg.eigh(off.T @ off / number)
    noise = standard_normal(rng, *drawn.shape) @ (vectors * np.sqrt(values.clip(0.0) * width2)).T
    off *= np.sqrt(1 - width2)
    off += noise
    off += mean - np.full(number, 1 / number) @ noise
    return off


def tempering_exponent(log_likelihood: Samples, share: float) -> float:
    """About the largest power of the likelihood, at most 1, that leaves a `share` of the samples by
    rejection.

    What is left falls with the power, ever more slowly in its logarithm: a straight line from the
    start leads to a power that is a little too large, and from there on ever nearer.
    """
    relative = (log_likelihood - log_likelihood.max()).astype(np.float32)
    power = 1.0
    aimed = float(np.log(share))
    for _ in range(STRAIGHTS):
        left = float(np.log(np.exp(power * relative).mean()))
        if left >= aimed:
            break
        power *= aimed / left
    return power


def rejection_resample(
    samples: Samples, log_likelihood: Samples, fewest: int, rng: np.random.Generator
) -> tuple[Samples, float]:
    """What rejection leaves of (n, d) samples, with a little about each, and the share that it is.

    Each stays with a probability proportional to its likelihood, and of those alike in the last
    column as many as should: independent draws would let the mean of what the likelihood says
    nothing of walk away, view by view. Where fewer than `fewest` would stay, that many are drawn
    with the same probabilities, some more than once.
    """
    order = np.argsort(samples[:, -1], kind="stable")
    chances = np.exp(log_likelihood - log_likelihood.max())[order]
    share = float(chances.mean())
    tell_apart = float(chances.sum() ** 2 / np.square(chances).sum())
    chances *= max(1.0, fewest / chances.sum())
    copies = np.diff(np.floor(np.cumsum(chances) + rng.random()), prepend=0.0).astype(np.int64)
    chosen = samples[np.repeat(order, copies)]
    return kernel_smooth(
        chosen if len(chosen) else samples[[int(log_likelihood.argmax())]], tell_apart, rng
    ), share


def resample(
    kept: Samples, number: int, jitter: float | Samples, rng: np.random.Generator
) -> Samples:
    """`number` samples of those kept, of each as many as of the next, moved a little so that none
    stands for many.
    """
    whole, rest = divmod(number, len(kept))
    evenly = np.arange(rest) * len(kept) // max(1, rest)
    moved: Samples = np.concatenate([kept] * whole + [kept[evenly]])
    return moved + standard_normal(rng, *moved.shape) * jitter if np.any(jitter) else moved
