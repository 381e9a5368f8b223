"""How much compute an update takes, and whether it takes more on a larger map."""

from __future__ import annotations

import gc

import numpy as np

from benchmarks.localization.loop import LOCALIZATION, LocalizationLoop
from benchmarks.localization.senses import BEARING_SD_RAD, RANGE_NOISE, Moment, label_of, seen
from benchmarks.report import Metrics
from cogmap.geometry.arrays import Floats
from schemas.sensing import Percept

IN_VIEW = 10
SMALL = 100
LARGE = 100_000
UPDATES = 600
LARGE_EVERY = 10
WARM_UP = 5
STEP_S = 0.2
SPEED_M_S = 1.0
TURN_RATE_RAD_S = 0.1
NEAR_M = 25.0
FAR_M = (100.0, 5000.0)
SEED = 11


class Circle:
    """A robot on a circle with its nearest landmarks in view, and others far away on the map."""

    def __init__(self, landmarks: int) -> None:
        self._rng = np.random.default_rng(SEED)
        self._near_m = self._rng.uniform(-NEAR_M, NEAR_M, (SMALL, 2))
        far_m = self._rng.uniform(*FAR_M, (landmarks - SMALL, 2))
        self._pose = np.array([0.0, -SPEED_M_S / TURN_RATE_RAD_S, 0.0])
        self._time_s = 0.0

        everything_m = np.vstack([self._near_m, far_m]).tolist()
        places = {label_of(number): (x, y) for number, (x, y) in enumerate(everything_m)}
        x_m, y_m, heading_rad = self._pose.tolist()
        self._loop = LocalizationLoop((x_m, y_m, heading_rad), places)

    def update_s(self) -> tuple[float, float]:
        """Drive a step and look: CPU time of localization, and of all tasks of the cycle."""
        self._loop.live(self._next())
        localization_s = sum(took_s for name, took_s in self._loop.task_s if name == LOCALIZATION)
        all_s = sum(took_s for _, took_s in self._loop.task_s)
        return localization_s, all_s

    def close(self) -> None:
        """End its modules."""
        self._loop.close()

    def _next(self) -> Moment:
        turn_rad = TURN_RATE_RAD_S * STEP_S
        distance_m = SPEED_M_S * STEP_S
        middle_rad = self._pose[2] + turn_rad / 2
        step_m = distance_m * np.array([np.cos(middle_rad), np.sin(middle_rad)])
        self._pose += [step_m[0], step_m[1], turn_rad]
        self._time_s += STEP_S

        offset_m = self._near_m - self._pose[:2]
        count = self._rng.integers(1, IN_VIEW + 1)
        nearest = np.argsort(np.hypot(*offset_m.T))[:count].tolist()
        percepts = [self._percept(number, offset_m[number]) for number in nearest]
        row = [SPEED_M_S, TURN_RATE_RAD_S, STEP_S, 0.1 * SPEED_M_S, 0.1 * TURN_RATE_RAD_S]
        return Moment(self._time_s, np.array([row]), percepts, True)

    def _percept(self, number: int, offset_m: Floats) -> Percept:
        distance_m = float(np.hypot(*offset_m))
        direction_rad = np.arctan2(offset_m[1], offset_m[0]) - self._pose[2]
        bearing_rad = direction_rad + self._rng.normal(0.0, BEARING_SD_RAD)
        range_m = self._rng.normal(distance_m, RANGE_NOISE * distance_m)
        wrapped_rad = float(np.remainder(bearing_rad + np.pi, 2 * np.pi) - np.pi)
        return seen(label_of(number), wrapped_rad, max(0.1, float(range_m)))


def measure() -> Metrics:
    """CPU times of the worker on both maps in turn; the ratio is of medians.

    `update_ms_*` is of the localization codelet alone, on the small map.
    """
    small = Circle(SMALL)
    large = Circle(LARGE)
    small_s = []
    large_s = []
    gc.collect()
    gc.freeze()  # a worker holds no map for the collector to look through

    for number in range(WARM_UP * LARGE_EVERY + UPDATES):
        small_s.append(small.update_s())
        if number % LARGE_EVERY == 0:
            large_s.append(large.update_s())

    gc.unfreeze()
    small.close()
    large.close()
    small_ms = 1e3 * np.array(small_s[WARM_UP * LARGE_EVERY :])
    large_ms = 1e3 * np.array(large_s[WARM_UP:])

    return {
        "update_ms_p50": float(np.median(small_ms[:, 0])),
        "update_ms_p99": float(np.quantile(small_ms[:, 0], 0.99)),
        "update_and_landmarks_ms_p99": float(np.quantile(small_ms[:, 1], 0.99)),
        "map_size_ratio": float(np.median(large_ms[:, 1]) / np.median(small_ms[:, 1])),
    }
