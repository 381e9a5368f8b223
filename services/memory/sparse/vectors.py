"""Vectors of the modular composite representation (Snaider and Franklin 2014), and their algebra.

A dimension holds one of `values` phases, evenly spaced on a circle. `values` is a power of two, at
most 256, and 16 unless stated; with two of them the vectors are binary, binding is exclusive or,
and a bundle is the majority of bits. All functions are pure.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Bytes, Floats, Indices

# Snaider and Franklin (2014): related is what is nearer than the mean by five standard deviations.
VALUES = 16
CONTAINED_SDS = 5.0
NO_LENGTH = 1e-6
"""Sums of unit vectors that are shorter have no direction but that of rounding errors."""

HALF_UP = 0.5 + 1e-9
"""Added before flooring. The margin takes ties upwards, whatever the rounding errors."""


def random_vectors(
    rng: np.random.Generator, count: int, dimensions: int, values: int = VALUES
) -> Bytes:
    """(count, dimensions): independent vectors of uniformly distributed values."""
    return rng.integers(0, values, (count, dimensions), np.uint8)


def bind(one: Bytes, other: Bytes, values: int = VALUES) -> Bytes:
    """Sum two vectors around the circle; the result is unrelated to both."""
    # uint8 wraps at 256, a multiple of `values`.
    return (one + other) & np.uint8(values - 1)


def unbind(bound: Bytes, one: Bytes, values: int = VALUES) -> Bytes:
    """Return what was bound to `one`: the inverse of `bind`."""
    return (bound - one) & np.uint8(values - 1)


def permuted(vector: Bytes, steps: int) -> Bytes:
    """Rotate the dimensions by some steps. The negative of `steps` undoes it."""
    return np.roll(vector, steps)


def bundle(vectors: Bytes, values: int = VALUES) -> Bytes:
    """Make a vector near to each of (n, dimensions): the sums of their unit vectors, as phases.

    A sum half-way between two phases becomes the later one, and a dimension in which the unit
    vectors cancel out has the first vector's value.
    """
    sums = unit_vectors(vectors, values).sum(axis=1)
    return nearest_phases(sums, vectors[0], values)


def unit_vectors(vectors: Bytes, values: int = VALUES) -> Floats:
    """Return the cosines and the sines of each phase, (2, ...)."""
    angles_rad = np.arange(values) * (math.tau / values)
    table = np.stack([np.cos(angles_rad), np.sin(angles_rad)])
    return table[:, vectors]


def nearest_phases(sums: Floats, otherwise: Bytes, values: int = VALUES) -> Bytes:
    """Find the phase nearest to the direction of each column of `sums` (2, dimensions), and take
    that of `otherwise` where a column has no direction.
    """
    cosines, sines = sums
    phases = np.arctan2(sines, cosines) * (values / math.tau)
    nearest = np.floor(phases + HALF_UP).astype(np.int64) % values

    has_direction = np.hypot(cosines, sines) > NO_LENGTH
    return np.where(has_direction, nearest, otherwise).astype(np.uint8)


def distance(one: Bytes, other: Bytes, values: int = VALUES) -> int:
    """Sum over the dimensions how far apart the values are, the shorter way around."""
    return int(distances(one, other, values))


def distances(rows: Bytes, vector: Bytes, values: int = VALUES) -> Indices:
    """Compute the distance of each of (n, dimensions) from one vector, (n,)."""
    forwards = unbind(rows, vector, values)
    backwards = unbind(vector, rows, values)
    sums: Indices = np.minimum(forwards, backwards).sum(axis=-1, dtype=np.int64)
    return sums


def mean_distance(dimensions: int, values: int = VALUES) -> float:
    """Compute the mean distance of unrelated vectors: 4096 for 1,024 dimensions of 16 values."""
    return dimensions * values / 4


def sd_distance(dimensions: int, values: int = VALUES) -> float:
    """Compute the standard deviation of the distances of unrelated vectors: 75 for 1,024 dimensions
    of 16 values.
    """
    variance = (values**2 + 8) / 48
    return math.sqrt(dimensions * variance)


def contained_below(dimensions: int, values: int = VALUES) -> float:
    """Compute the distance below which two vectors are related: CONTAINED_SDS standard deviations
    below the mean. One pair of unrelated vectors in three million is that near.
    """
    spread = sd_distance(dimensions, values)
    return mean_distance(dimensions, values) - CONTAINED_SDS * spread


def contains(one: Bytes, other: Bytes, values: int = VALUES) -> bool:
    """Decide whether a bundle contains a vector: whether the two are related, either way round."""
    return distance(one, other, values) < contained_below(len(one), values)
