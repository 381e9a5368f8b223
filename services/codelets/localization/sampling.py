"""Distributions as Monte-Carlo samples: rejection, resampling, moments (paper §5.4).

(n, d) samples are best stored column by column, as the functions here return them: what is computed
of each column then reads consecutive numbers, in a fraction of the time.
"""

from __future__ import annotations

import hashlib
import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from numpy.random.bit_generator import ISeedSequence

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import FULL_TURN_RAD, mean_pose, wrap_angle

Samples = Floats
SECANT_STEPS = 4
# Added when samples are inflated, which may all be the same: metres, metres, radians.
INFLATION_SD = np.array([0.02, 0.02, 0.01])
MAX_KERNEL_VARIANCE = 0.9


class _Digest(ISeedSequence):
    """A hash as the first state of a generator: its bits need none of the mixing that NumPy gives
    to a seed, which takes longer than some tasks' draws.
    """

    def __init__(self, identifier: str) -> None:
        content = identifier.encode()
        self._bytes = hashlib.blake2b(content).digest()

    def generate_state(
        self, n_words: int, dtype: npt.DTypeLike = np.uint32
    ) -> npt.NDArray[np.uint32 | np.uint64]:
        return np.frombuffer(self._bytes, dtype, n_words)


def generator(identifier: str) -> np.random.Generator:
    """A generator seeded by `identifier` alone, so that every worker draws the same numbers."""
    state = np.random.PCG64(_Digest(identifier))  # type: ignore[arg-type]  # its stub lacks the ABC
    return np.random.Generator(state)


def standard_normal(rng: np.random.Generator, count: int, columns: int) -> Samples:
    """(count, columns) standard normal numbers of single precision: noise needs no more."""
    numbers = rng.standard_normal((columns, count), np.float32)
    double = numbers.astype(np.float64)
    return double.T


def select(samples: Samples, chosen: Indices) -> Samples:
    """The rows `chosen` of (n, d) samples."""
    columns = samples.T.take(chosen, axis=1)
    return columns.T


@lru_cache(maxsize=256)
def equal_weights(count: int) -> Samples:
    """(count,): what a mean weighs each number by. A product with it takes a fraction of the time
    of mean().
    """
    weights = np.full(count, 1 / count)
    weights.flags.writeable = False
    return weights


def centred(samples: Samples) -> tuple[Samples, Samples]:
    """The mean (d,) of (n, d) samples and their deviations (n, d) from it. Of three columns or more
    the third is a heading.
    """
    count, columns = samples.shape
    weights = equal_weights(count)
    mean = weights @ samples
    if columns < 3:
        return mean, samples - mean

    headings_rad = np.ascontiguousarray(samples[:, 2])
    sin = weights @ np.sin(headings_rad)
    cos = weights @ np.cos(headings_rad)
    mean[2] = np.arctan2(sin, cos)

    deviations = samples - mean
    turns = np.rint(deviations[:, 2] / FULL_TURN_RAD)
    deviations[:, 2] -= FULL_TURN_RAD * turns
    return mean, deviations


def spread(deviations: Samples) -> Samples:
    """(d,): the standard deviations of samples that deviate by (n, d) from their mean."""
    count = len(deviations)
    squares = np.einsum("nd,nd->d", deviations, deviations)
    variances = squares / count
    return np.asarray(np.sqrt(variances))


def rejection_mask(log_likelihood: Samples, rng: np.random.Generator) -> Booleans:
    """(n,): which samples rejection keeps, each with a probability proportional to its likelihood.

    The likeliest is always kept, so that one is even where all are unlikely.
    """
    probability = _relative(log_likelihood)
    likeliest = int(probability.argmax())

    kept: Booleans = rng.random(len(probability)) < probability
    kept[likeliest] = True
    return kept


def _relative(log_likelihood: Samples) -> Samples:
    """Likelihoods relative to the largest, any shape."""
    below = log_likelihood - log_likelihood.max()
    return np.asarray(np.exp(below))


def inflate(poses: Samples, factor: float, rng: np.random.Generator) -> Samples:
    """Samples whose first three columns deviate `factor` times as far from their mean, and a little
    at random.
    """
    mean = mean_pose(poses)
    deviations = poses[:, :3] - mean
    deviations[:, 2] = wrap_angle(deviations[:, 2])

    noise = rng.normal(0.0, 1.0, deviations.shape)
    result = poses.copy()
    result[:, :3] = mean + factor * deviations + INFLATION_SD * noise
    return result


def kernel_smooth(drawn: Samples, effective: float, rng: np.random.Generator) -> Samples:
    """(n, d) samples in place of `drawn`, which repeats few, with the same mean and covariance.

    A Gaussian kernel of Silverman's width for `effective` samples, shrunk towards the mean by as
    much (Liu and West 2001). Of three columns or more the third is a heading.
    """
    count, columns = drawn.shape
    mean, deviations = centred(drawn)
    variance = _kernel_variance(effective, columns)

    covariance = deviations.T @ deviations / count
    values, vectors = np.linalg.eigh(covariance)
    sds = np.sqrt(values.clip(0.0) * variance)
    root = vectors * sds

    normal = standard_normal(rng, count, columns)
    noise = (root @ normal.T).T
    deviations *= math.sqrt(1 - variance)
    deviations += noise
    deviations += mean - equal_weights(count) @ noise
    return deviations


def _kernel_variance(effective: float, columns: int) -> float:
    """The variance of a Gaussian kernel of Silverman's width, as a share of the samples'."""
    weight = (columns + 2) * max(1.0, effective)
    exponent = 1 / (columns + 4)
    width = math.pow(4 / weight, exponent)
    return min(MAX_KERNEL_VARIANCE, width**2)


def tempering_exponent(log_likelihood: Samples, share: float) -> float:
    """About the largest power of the likelihood, at most 1, with which rejection keeps a `share` of
    the samples.

    The logarithm of what is kept falls with the power, ever more slowly: a straight line from the
    start leads to a power that is a little too large, and from there on ever nearer.
    """
    count = len(log_likelihood)
    below = log_likelihood - log_likelihood.max()
    below = below.astype(np.float32)
    target = math.log(share)

    power = 1.0
    for _ in range(SECANT_STEPS):
        kept = np.exp(power * below).sum() / count
        log_kept = math.log(kept)
        if log_kept >= target:
            break
        power *= target / log_kept

    return power


def rejection_resample(
    samples: Samples, log_likelihood: Samples, min_kept: int, rng: np.random.Generator
) -> tuple[Samples, float]:
    """What rejection keeps of (n, d) samples, smoothed by a kernel, and the share that it is.

    Each is kept with a probability proportional to its likelihood, and of those alike in the last
    column as many as expected: independent draws would let the mean of what the likelihood does not
    inform drift, view by view. Where fewer than `min_kept` would be kept, that many are drawn with
    the same probabilities, some repeatedly.
    """
    order = np.argsort(samples[:, -1], kind="stable")
    probability = _relative(log_likelihood)[order]
    total = float(probability.sum())
    share = total / len(probability)
    effective = total**2 / float(probability @ probability)

    expected = probability * max(1.0, min_kept / total)
    copies = _systematic(expected, rng)
    kept = select(samples, order.repeat(copies))
    if not len(kept):
        likeliest = np.array([log_likelihood.argmax()])
        kept = select(samples, likeliest)

    return kernel_smooth(kept, effective, rng), share


def _systematic(expected: Samples, rng: np.random.Generator) -> Indices:
    """(n,): how often each sample is drawn, as often as `expected` (n,) on the mean: of each run of
    samples as often as their sum, but for one.
    """
    offset = rng.random()
    summed = np.cumsum(expected)
    through = np.zeros(len(expected) + 1)
    np.floor(summed + offset, out=through[1:])

    copies = through[1:] - through[:-1]
    return copies.astype(np.int64)


def resample(kept: Samples, count: int) -> Samples:
    """`count` samples of those kept, each as often as the next."""
    whole, rest = divmod(count, len(kept))
    columns = [kept.T] * whole
    if rest:
        evenly = np.arange(rest) * len(kept) // rest
        columns.append(kept.T.take(evenly, axis=1))

    return np.concatenate(columns, axis=1).T


def jittered(samples: Samples, sd: Samples, rng: np.random.Generator) -> Samples:
    """(n, d) samples with normal noise of standard deviations `sd` (d,)."""
    noise = standard_normal(rng, *samples.shape)
    return samples + noise * sd
