"""Distributions as Monte-Carlo samples: rejection, resampling, moments (paper §5.4)."""

from __future__ import annotations

import hashlib
import math

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import FULL_TURN_RAD, mean_pose, wrap_angle

Samples = Floats
# Near enough: where 0.25 of samples with normal errors are to be kept, 0.18 to 0.25 are.
SECANT_STEPS = 4
# Added when samples are inflated, which may all be the same: metres, metres, radians.
INFLATION_SD = np.array([0.02, 0.02, 0.01])
# A bound below 1 for a single effective sample; of two or more the kernel is narrower.
MAX_KERNEL_VARIANCE = 0.9


def generator(identifier: str) -> np.random.Generator:
    """Make a generator seeded by `identifier` alone, so that all workers draw the same numbers."""
    digest = hashlib.blake2b(identifier.encode(), digest_size=8).digest()
    return np.random.default_rng(int.from_bytes(digest))


def standard_normal(rng: np.random.Generator, *shape: int) -> Samples:
    """Draw standard normal numbers of single precision: they cost half, and noise needs no more."""
    return rng.standard_normal(shape, np.float32).astype(np.float64)


def centred(samples: Samples) -> tuple[Samples, Samples]:
    """Compute the mean (d,) of (n, d) samples and their deviations (n, d) from it. Of three columns
    or more the third is a heading.
    """
    count, columns = samples.shape
    weights = np.full(count, 1 / count)
    mean = weights @ samples
    if columns < 3:
        return mean, samples - mean

    headings_rad = np.ascontiguousarray(samples[:, 2])
    mean[2] = np.arctan2(weights @ np.sin(headings_rad), weights @ np.cos(headings_rad))
    deviations = samples - mean
    deviations[:, 2] -= FULL_TURN_RAD * np.rint(deviations[:, 2] / FULL_TURN_RAD)
    return mean, deviations


def spread(samples: Samples, mean: Samples) -> Samples:
    """Compute the standard deviation of each column about `mean`, (d,); of three columns the third
    is a heading.
    """
    deviations = samples - mean
    if samples.shape[1] == 3:
        deviations[:, 2] = wrap_angle(deviations[:, 2])
    return np.asarray(np.sqrt((deviations**2).mean(axis=0)))


def position_sd_m(samples: Samples) -> float:
    """Compute the standard deviation of the distance of (n, d) samples from their mean position,
    which is in the first two columns.
    """
    _, offsets_m = centred(samples[:, :2])
    variance_m2 = np.square(offsets_m).sum(axis=1).mean()
    return math.sqrt(variance_m2)


def rejection_mask(log_likelihood: Samples, rng: np.random.Generator) -> Booleans:
    """Draw which of (n,) samples rejection keeps, with probabilities proportional to likelihood.

    The likeliest is always kept, so that at least one is, even if all are unlikely.
    """
    probability = np.exp(log_likelihood - log_likelihood.max())
    kept: Booleans = rng.random(len(probability)) < probability
    kept[int(np.argmax(probability))] = True
    return kept


def inflate(poses: Samples, factor: float, rng: np.random.Generator) -> Samples:
    """Return samples whose first three columns deviate `factor` times as far from their mean, and a
    little at random.
    """
    mean = mean_pose(poses)
    deviations = poses[:, :3] - mean
    deviations[:, 2] = wrap_angle(deviations[:, 2])
    noise = rng.normal(0.0, 1.0, deviations.shape) * INFLATION_SD

    result = poses.copy()
    result[:, :3] = mean + factor * deviations + noise
    return result


def kernel_smooth(drawn: Samples, effective: float, rng: np.random.Generator) -> Samples:
    """Draw (n, d) samples in place of `drawn`, which repeats few, with its mean and covariance.

    They come from a Gaussian kernel of Silverman's width for `effective` samples, and are shrunk
    towards the mean by as much (Liu and West 2001). Of three columns or more the third is a
    heading.
    """
    count, columns = drawn.shape
    mean, deviations = centred(drawn)
    width = (4 / ((columns + 2) * max(1.0, effective))) ** (1 / (columns + 4))
    variance = min(MAX_KERNEL_VARIANCE, width**2)

    values, vectors = np.linalg.eigh(deviations.T @ deviations / count)
    root = vectors * np.sqrt(values.clip(0.0) * variance)
    noise = standard_normal(rng, *drawn.shape) @ root.T

    deviations *= np.sqrt(1 - variance)
    deviations += noise
    deviations += mean - np.full(count, 1 / count) @ noise
    return deviations


def tempering_exponent(log_likelihood: Samples, share: float) -> float:
    """Approximate the largest power of the likelihood, at most 1, with which rejection keeps a
    `share` of the samples.

    The logarithm of what is kept falls with the power, ever more slowly: a straight line from the
    start leads to a power that is a little too large, and each line after it to one that is nearer.
    """
    relative = (log_likelihood - log_likelihood.max()).astype(np.float32)
    target = float(np.log(share))
    power = 1.0
    for _ in range(SECANT_STEPS):
        kept = float(np.log(np.exp(power * relative).mean()))
        if kept >= target:
            break
        power *= target / kept
    return power


def rejection_resample(
    samples: Samples, log_likelihood: Samples, min_kept: int, rng: np.random.Generator
) -> tuple[Samples, float]:
    """Return what rejection keeps of (n, d) samples, smoothed by a kernel, and the share that it
    is.

    Each is kept with a probability proportional to its likelihood, and of those alike in the last
    column as many as expected: independent draws would let the mean of what the likelihood does not
    inform drift, view by view. If fewer than `min_kept` would be kept, that many are drawn with
    the same probabilities, some repeatedly.
    """
    order = np.argsort(samples[:, -1], kind="stable")
    probability = np.exp(log_likelihood - log_likelihood.max())[order]
    share = float(probability.mean())
    effective = float(probability.sum() ** 2 / np.square(probability).sum())

    expected = probability * max(1.0, min_kept / probability.sum())
    drawn = np.zeros(len(samples) + 1)
    np.floor(np.cumsum(expected) + rng.random(), out=drawn[1:])
    copies = (drawn[1:] - drawn[:-1]).astype(np.int64)
    kept = samples.take(order.repeat(copies), axis=0)
    if not len(kept):
        kept = samples[[int(log_likelihood.argmax())]]
    return kernel_smooth(kept, effective, rng), share


def resample(
    kept: Samples, count: int, jitter: float | Samples, rng: np.random.Generator
) -> Samples:
    """Repeat the samples that were kept, each equally often, to get `count` of them, and add normal
    noise of standard deviation `jitter`, one for all columns or (d,).
    """
    whole, rest = divmod(count, len(kept))
    evenly = np.arange(rest) * len(kept) // max(1, rest)
    copies: Samples = np.concatenate([kept] * whole + [kept[evenly]])
    if not np.any(jitter):
        return copies
    return copies + standard_normal(rng, *copies.shape) * jitter
