"""The CPU time of an update, and its ratio on a large map to that on a small one."""

from __future__ import annotations

import gc
import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np

from benchmarks import optional
from benchmarks.localization.loop import LANDMARK, LOCALIZATION, LocalizationLoop
from benchmarks.localization.senses import BEARING_SD_RAD, RANGE_NOISE, Moment, label_of, seen
from benchmarks.report import Metrics
from cogmap.schemas.sensing import Percept

IN_VIEW = 10
SMALL = 100
LARGE = 100_000
UPDATES = 600
LARGE_EVERY = 10
WARM_UP = 5
STEP_S = 0.2
SPEED_M_S = 1.0
TURN_RATE_RAD_S = 0.1
NOISE_SHARE = 0.1
MIN_RANGE_M = 0.1
NEAR_M = 25.0
FAR_M = (100.0, 5000.0)
SEED = 11


class Times(NamedTuple):
    """CPU times of a cycle's tasks, in s: the localization codelet's, the landmark codelet's, and
    those of all.
    """

    localization_s: float
    landmark_s: float
    all_s: float


class Circle:
    """A robot on a circle with its nearest landmarks in view, and others far away on the map."""

    def __init__(self, landmarks: int) -> None:
        self._rng = np.random.default_rng(SEED)
        self._near_m = self._rng.uniform(-NEAR_M, NEAR_M, (SMALL, 2))
        far_m = self._rng.uniform(*FAR_M, (landmarks - SMALL, 2))
        places = {}
        for number, (x_m, y_m) in enumerate(np.vstack([self._near_m, far_m]).tolist()):
            places[label_of(number)] = (x_m, y_m)

        radius_m = SPEED_M_S / TURN_RATE_RAD_S
        start = (0.0, -radius_m, 0.0)
        self._pose = np.array(start)
        self._time_s = 0.0
        self._loop = LocalizationLoop(start, places)

    def update_s(self) -> Times:
        """Drive a step and look."""
        turn_rad = TURN_RATE_RAD_S * STEP_S
        distance_m = SPEED_M_S * STEP_S
        middle_rad = self._pose[2] + turn_rad / 2
        ahead_x_m = distance_m * np.cos(middle_rad)
        ahead_y_m = distance_m * np.sin(middle_rad)
        self._pose += [ahead_x_m, ahead_y_m, turn_rad]
        self._time_s += STEP_S

        speed_sd = NOISE_SHARE * SPEED_M_S
        turn_rate_sd = NOISE_SHARE * TURN_RATE_RAD_S
        motion = [SPEED_M_S, TURN_RATE_RAD_S, STEP_S, speed_sd, turn_rate_sd]
        self._loop.live(Moment(self._time_s, np.array([motion]), self._percepts(), True))

        of_codelet: dict[str, float] = defaultdict(float)
        for codelet, took_s in self._loop.task_s:
            of_codelet[codelet] += took_s

        return Times(of_codelet[LOCALIZATION], of_codelet[LANDMARK], sum(of_codelet.values()))

    def close(self) -> None:
        """End its modules."""
        self._loop.close()

    def _percepts(self) -> list[Percept]:
        """Draw percepts of some of the nearest landmarks, up to IN_VIEW."""
        offsets_m = self._near_m - self._pose[:2]
        nearest = np.argsort(np.hypot(*offsets_m.T))
        count = self._rng.integers(1, IN_VIEW + 1)
        percepts = []

        for number in nearest[:count].tolist():
            x_m, y_m = offsets_m[number].tolist()
            direction_rad = math.atan2(y_m, x_m) - self._pose[2]
            bearing_rad = direction_rad + self._rng.normal(0.0, BEARING_SD_RAD)
            distance_m = math.hypot(x_m, y_m)
            range_m = max(MIN_RANGE_M, self._rng.normal(distance_m, RANGE_NOISE * distance_m))
            wrapped_rad = math.remainder(bearing_rad, math.tau)
            percepts.append(seen(label_of(number), wrapped_rad, range_m))

        return percepts


def _drive_both(small: Circle, large: Circle) -> tuple[list[Times], Times]:
    """Measure LARGE_EVERY updates on the small map, and one on the large."""
    small_s = [small.update_s() for _ in range(LARGE_EVERY)]
    return small_s, large.update_s()


def measure() -> Metrics:
    """Measure CPU times of the worker on both maps in turn; the ratio is of medians.

    `update_ms_*` is of the localization codelet alone, on the small map; the ratio is of all tasks
    of a cycle. Linear algebra has one thread, as in processes of the system.

    Raises UsageError if threadpoolctl is not installed.
    """
    small = Circle(SMALL)
    large = Circle(LARGE)
    gc.collect()
    gc.freeze()  # a worker holds no map for the collector to look through

    for _ in range(WARM_UP):
        _drive_both(small, large)

    small_s: list[Times] = []
    large_s: list[Times] = []
    # By now all libraries are loaded that it limits.
    with optional.threadpoolctl().threadpool_limits(1):
        for _ in range(UPDATES // LARGE_EVERY):
            of_small_s, of_large_s = _drive_both(small, large)
            small_s += of_small_s
            large_s.append(of_large_s)

    gc.unfreeze()
    small.close()
    large.close()
    localization_ms, landmark_ms, small_ms = 1e3 * np.array(small_s).T
    _, _, large_ms = 1e3 * np.array(large_s).T

    return {
        "update_ms_p50": float(np.median(localization_ms)),
        "update_ms_p99": float(np.quantile(localization_ms, 0.99)),
        "update_and_landmarks_ms_p99": float(np.quantile(localization_ms + landmark_ms, 0.99)),
        "map_size_ratio": float(np.median(large_ms) / np.median(small_ms)),
    }
