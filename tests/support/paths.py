"""Distances along and between paths, for the assertions of tests."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def distances_m(one: Floats, other: Floats) -> Floats:
    """(n,): from each row's position to the position of the same row of the other."""
    off_m = one[..., :2] - other[..., :2]
    return np.hypot(off_m[..., 0], off_m[..., 1])


def mean_distance_m(one: Floats, other: Floats) -> float:
    """The mean of those distances."""
    return float(distances_m(one, other).mean())


def steps_m(path: Floats) -> Floats:
    """(n - 1,): how long each step of a path is."""
    return distances_m(path[1:], path[:-1])
