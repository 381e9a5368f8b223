"""A walk through a square room by noisy self-motion, whose walls are sensed from near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.experiments.spiking.network import SOUTH, WEST, Border
from cogmap.geometry.arrays import Floats

SIDE_M = 5.0
STEP_M = 0.15
"""A rat's foraging, some 15 cm/s, a step a second."""

ALONG_SHARE = 0.3
ACROSS_SHARE = 0.15
"""Self-motion's standard deviations over the length of a step, along it and across."""

REACH_M = 1.2
"""Walls are sensed from so near: in the middle of the room nothing corrects path integration."""

BORDER_SD_M = 0.15
START_SD_M = 0.05
TURN_SD_RAD = 0.4
MARGIN_M = 0.5


@dataclass(frozen=True)
class Walk:
    """n steps: (n, 2) `moved_m` that self-motion measures, the (n, 2, 2) `covariance_m2` of their
    errors, the (n, 2) `true_m` after each, and the walls that are sensed there. It starts about
    (2,) `start_m`, START_SD_M away along x and y.
    """

    start_m: Floats
    moved_m: Floats
    covariance_m2: Floats
    true_m: Floats
    borders: tuple[tuple[Border, ...], ...]


def walk(seed: int, steps: int) -> Walk:
    """Draw a walk of `steps` steps: straight on, more or less, and away from a wall that is near.

    What self-motion measures is what the walker intends; by what it errs, the walker strays.
    """
    rng = np.random.default_rng([seed, 0])
    middle_m = np.full(2, SIDE_M / 2)
    place_m = rng.normal(middle_m, START_SD_M)
    heading_rad = float(rng.uniform(-np.pi, np.pi))

    moved_m = np.zeros((steps, 2))
    covariance_m2 = np.zeros((steps, 2, 2))
    true_m = np.zeros((steps, 2))
    borders = []
    for number in range(steps):
        heading_rad = _turned(heading_rad, place_m, rng)
        ahead = np.array([np.cos(heading_rad), np.sin(heading_rad)])
        moved_m[number] = STEP_M * ahead
        covariance_m2[number] = step_covariance_m2(moved_m[number])

        place_m = place_m + rng.multivariate_normal(moved_m[number], covariance_m2[number])
        true_m[number] = place_m
        borders.append(_sensed(place_m, rng))

    return Walk(middle_m, moved_m, covariance_m2, true_m, tuple(borders))


def step_covariance_m2(moved_m: Floats) -> Floats:
    """Return the covariance (2, 2) of the error of a step (2,): ALONG_SHARE of its length along it,
    ACROSS_SHARE across.
    """
    across_m = np.array([-moved_m[1], moved_m[0]])
    along_m2: Floats = ALONG_SHARE**2 * np.outer(moved_m, moved_m)
    return along_m2 + ACROSS_SHARE**2 * np.outer(across_m, across_m)


def _turned(heading_rad: float, place_m: Floats, rng: np.random.Generator) -> float:
    """Turn a little at random; near a wall towards the middle of the room."""
    heading_rad += float(rng.normal(0.0, TURN_SD_RAD))
    is_near = (place_m < MARGIN_M).any() or (place_m > SIDE_M - MARGIN_M).any()
    if is_near:
        x_m, y_m = (SIDE_M / 2 - place_m).tolist()
        heading_rad = float(np.arctan2(y_m, x_m) + rng.normal(0.0, TURN_SD_RAD))

    return heading_rad


def _sensed(place_m: Floats, rng: np.random.Generator) -> tuple[Border, ...]:
    """Sense the walls within reach, each as a coordinate: of the far walls, too, the distance gives
    where along the axis the walker is.
    """
    borders = []
    for axis in (WEST, SOUTH):
        coordinate_m = float(place_m[axis])
        distance_m = min(coordinate_m, SIDE_M - coordinate_m)
        if distance_m < REACH_M:
            sensed_m = float(rng.normal(coordinate_m, BORDER_SD_M))
            borders.append(Border(axis, sensed_m, BORDER_SD_M))

    return tuple(borders)
