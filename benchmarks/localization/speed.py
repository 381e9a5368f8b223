"""How long an update takes, and whether it takes longer on a larger map."""

from __future__ import annotations

import gc
import time

import numpy as np

from benchmarks.localization.loop import Mind
from benchmarks.localization.senses import BEARING_SD_RAD, RANGE_NOISE, Moment, label_of
from schemas.sensing import Percept

IN_VIEW = 10
SMALL = 100
LARGE = 100_000
UPDATES = 600
WARM_UP = 50
STEP_S = 0.2
SPEED_M_S = 1.0
TURN_RATE = 0.1
SEED = 11


class Round:
    """A robot on a circle among landmarks, of which it has always the ten nearest in view, and
    others far away.
    """

    def __init__(self, landmarks: int) -> None:
        rng = np.random.default_rng(SEED)
        near = rng.uniform(-25.0, 25.0, (SMALL, 2))
        far = rng.uniform(100.0, 5000.0, (landmarks - SMALL, 2))
        self._near = near
        self._pose = np.array([0.0, -SPEED_M_S / TURN_RATE, 0.0])
        self._rng = rng
        self._time_s = 0.0
        self.mind = Mind((float(self._pose[0]), float(self._pose[1]), 0.0))
        self.mind.learn(
            {label_of(i): (float(x), float(y)) for i, (x, y) in enumerate(np.vstack([near, far]))},
            False,
        )

    def next(self) -> Moment:
        """It drives on for a step, and looks."""
        middle = self._pose[2] + TURN_RATE * STEP_S / 2
        ahead = SPEED_M_S * STEP_S * np.array([np.cos(middle), np.sin(middle)])
        self._pose += [ahead[0], ahead[1], TURN_RATE * STEP_S]
        self._time_s += STEP_S
        offset = self._near - self._pose[:2]
        distance = np.hypot(offset[:, 0], offset[:, 1])
        nearest = np.argsort(distance)[: self._rng.integers(1, IN_VIEW + 1)]
        percepts = [self._percept(int(i), float(distance[i]), offset[i]) for i in nearest]
        motions = np.array([[SPEED_M_S, TURN_RATE, STEP_S, 0.1 * SPEED_M_S, 0.1 * TURN_RATE]])
        return Moment(self._time_s, motions, percepts, True)

    def _percept(self, index: int, distance: float, offset: np.ndarray) -> Percept:
        bearing = float(
            np.arctan2(offset[1], offset[0]) - self._pose[2] + self._rng.normal(0.0, BEARING_SD_RAD)
        )
        return Percept(
            label=label_of(index),
            activation=1.0,
            bearing_rad=float(np.remainder(bearing + np.pi, 2 * np.pi) - np.pi),
            range_m=max(0.1, float(self._rng.normal(distance, RANGE_NOISE * distance))),
            bearing_sd_rad=float(BEARING_SD_RAD),
            range_sd_m=RANGE_NOISE * max(distance, 0.1),
            width_m=0.0,
            height_m=0.0,
            whole=True,
            box_px=(0, 0, 0, 0),
        )


def measure() -> dict[str, float]:
    """Times on both maps in turn, so that both meet the same machine; the ratio is of medians."""
    rounds = {size: Round(size) for size in (SMALL, LARGE)}
    times: dict[int, list[tuple[float, float]]] = {size: [] for size in rounds}
    gc.collect()
    gc.freeze()  # a worker holds no map for the collector to look through
    for _ in range(WARM_UP + UPDATES):
        for size, each in rounds.items():
            moment = each.next()
            began = time.perf_counter()
            each.mind.localize(moment)
            localized = time.perf_counter()
            each.mind.map(moment)
            times[size].append((localized - began, time.perf_counter() - began))
    gc.unfreeze()
    own, whole = (
        np.array([column[WARM_UP:] for column in zip(*times[size], strict=True)]) * 1e3
        for size in rounds
    )
    return {
        "update_ms_p50": float(np.median(own[0])),
        "update_ms_p99": float(np.quantile(own[0], 0.99)),
        "update_and_landmarks_ms_p99": float(np.quantile(own[1], 0.99)),
        "map_size_ratio": float(np.median(whole[1]) / np.median(own[1])),
    }
