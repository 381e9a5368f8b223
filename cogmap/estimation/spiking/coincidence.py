"""One step of localization by spikes: which place cells fire on the coincidence of path integration
and of what is sensed (paper §5.4, figure 4).

In each gamma cycle the grid cells and the head-direction cells represent one pose, a sample of path
integration. Place cells are tuned to a direction too, as they are on a path that is driven one way.
One fires in a cycle in which its grid cells, its head-direction cell and each of its cells for what
is sensed fire together: rejection sampling, whose samples are the spikes.

The fields of real grid cells grow from one module to the next along the entorhinal cortex. Here the
ladder of modules has no end: the finest that is listened to has fields that are narrow beside what
path integration leaves possible, so that a spike says little less than the sample did, and the
widest tells apart all places that are possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cogmap.estimation.spiking.cells import (
    PEAK,
    SPACINGS_M,
    GridModule,
    generate,
    pairs,
)
from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.geometry.se2 import FULL_TURN_RAD

Tuning = Callable[[Floats], Singles]
"""Computes for (m, d) poses how much of its peak each of k inputs fires at: (k, m)."""

STEP = math.sqrt(math.e)
"""From one module's spacing to the next."""

FINEST_SDS = 1.25
"""The finest spacing over the least standard deviation of position, at most: place fields then
widen a variance by 2 %, and as in figure 4 five modules reach over all samples of a round cloud."""

PLACES_A_FIELD = 8
MAX_PLACES_ACROSS = 96
WIDEST_SHARE = 0.75
"""The widest spacing over the extent of the samples, at least, as in figure 4's room."""

DIRECTION_SDS = 0.1
"""A head-direction cell's width over the standard deviation of headings: far narrower than a real
cell's, as a population of those tells a direction. By the same 2 %, on no data."""

DIRECTIONS_A_SD = 5
MIN_SD_M = 0.005
MIN_SD_RAD = 5e-4
SILENT = math.exp(-8)
"""An input that no active place cell drives to this share of its peak, four standard deviations
away, stays silent."""


def fire(samples: Floats, tuning: Tuning, rng: np.random.Generator) -> Floats:
    """Return the poses (m, d) that the place cells stand for which fire, one for each spike, if
    path integration represents each of (n, d) samples in a cycle: x, y, and with d = 3 the heading.

    Inhibition sets the gain of each input, so that the place cell that it drives most, of those
    that path integration makes active, gets it at its peak.
    """
    poses = represented(samples, rng)
    if not len(poses):
        return poses

    share = tuning(poses)
    largest = share.max(axis=1, keepdims=True)
    if (largest < SILENT).any():
        return poses[:0]

    drawn = rng.random(share.shape, np.float32)
    fires: Booleans = (drawn * largest < PEAK * share).all(axis=0)
    spikes: Floats = poses[fires]
    return spikes


def represented(samples: Floats, rng: np.random.Generator) -> Floats:
    """Return the poses (m, d) of the place cells whose grid cells and head-direction cell fire
    together, for (n, d) samples, one a cycle; of one cycle none or several.
    """
    cycles, places_m = _places(samples[:, :2], rng)
    if samples.shape[1] == 2:
        return places_m

    directed, directions_rad = _directions(samples[:, 2], rng)
    counts = directed.sum(axis=1)
    repeated = np.repeat(np.arange(len(cycles)), counts[cycles])
    _, cells = np.nonzero(directed[cycles])
    return np.column_stack([places_m[repeated], directions_rad[cells]])


def spacings_m(positions_m: Floats) -> list[float]:
    """Choose the modules that are listened to for (n, 2) samples: of the ladder that begins at
    figure 4's finest and goes on either way, at least as many as there.
    """
    covariance_m2 = np.cov(positions_m, rowvar=False) if len(positions_m) > 1 else np.zeros((2, 2))
    least_m2, _ = np.linalg.eigvalsh(covariance_m2)
    sd_m = max(math.sqrt(max(float(least_m2), 0.0)), MIN_SD_M)
    extent_m = float(np.ptp(positions_m, axis=0).max())

    finest_m = max(FINEST_SDS * sd_m, extent_m * PLACES_A_FIELD / MAX_PLACES_ACROSS)
    first = math.floor(math.log(finest_m / SPACINGS_M[0]) / math.log(STEP))
    chosen: list[float] = []
    while len(chosen) < len(SPACINGS_M) or chosen[-1] < WIDEST_SHARE * extent_m:
        chosen.append(SPACINGS_M[0] * STEP ** (first + len(chosen)))

    return chosen


def _places(positions_m: Floats, rng: np.random.Generator) -> tuple[Indices, Floats]:
    """Return for each place cell that all its grid cells drive in a cycle that cycle, (m,), and
    where its field is, (m, 2).
    """
    modules = [GridModule(spacing_m) for spacing_m in spacings_m(positions_m)]
    apart_m = modules[0].spacing_m / PLACES_A_FIELD
    first = np.floor(positions_m.min(axis=0) / apart_m).astype(np.int64) - 1
    last = np.ceil(positions_m.max(axis=0) / apart_m).astype(np.int64) + 1
    columns, rows = (np.arange(low, high + 1) for low, high in zip(first, last, strict=True))
    centres_m = pairs(columns * apart_m, rows * apart_m)

    # The lattices begin where the agent is: numbers stay small far from the origin.
    origin_m = centres_m[0]
    fired = np.full((len(centres_m), math.ceil(len(positions_m) / 8)), 0xFF, np.uint8)
    for module in modules:
        spikes = generate(module.tuning(positions_m - origin_m), rng)
        fired &= spikes[module.nearest(centres_m - origin_m)]

    active = np.flatnonzero(fired.any(axis=1))
    cells, cycles = np.nonzero(np.unpackbits(fired[active], axis=1, count=len(positions_m)))
    return cycles, centres_m[active[cells]]


def _directions(headings_rad: Floats, rng: np.random.Generator) -> tuple[Booleans, Floats]:
    """Return which head-direction cells fire for (n,) headings, one a cycle, (n, h), and the
    direction that each prefers, (h,).
    """
    mean_rad = math.atan2(float(np.sin(headings_rad).mean()), float(np.cos(headings_rad).mean()))
    deviations_rad = headings_rad - mean_rad
    deviations_rad = deviations_rad - FULL_TURN_RAD * np.rint(deviations_rad / FULL_TURN_RAD)
    sd_rad = max(float(np.sqrt(np.square(deviations_rad).mean())), MIN_SD_RAD)

    apart_rad = sd_rad / DIRECTIONS_A_SD
    low = math.floor(deviations_rad.min() / apart_rad) - 1
    high = math.ceil(deviations_rad.max() / apart_rad) + 1
    preferred_rad = np.arange(low, high + 1) * apart_rad

    deviations = (deviations_rad[:, None] - preferred_rad) / (DIRECTION_SDS * sd_rad)
    share = np.exp(-np.square(deviations.astype(np.float32)) / 2)
    fires: Booleans = rng.random(share.shape, np.float32) < PEAK * share
    return fires, mean_rad + preferred_rad
