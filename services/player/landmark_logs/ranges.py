"""A robot among radio beacons: ranges alone, to beacons that say who they are."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cogmap.data import plaza
from cogmap.data.true_path import poses_at
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.player.config import Config
from cogmap.services.player.landmark_logs.settings import of_points
from cogmap.services.player.landmark_logs.sightings import sighting
from cogmap.services.player.landmark_logs.views import (
    LandmarkLog,
    check_landmarks,
    notes_of_order,
    view_stamps,
)
from cogmap.services.player.landmark_logs.wheels import Wheels
from cogmap.services.player.recording import poses_of

RANGE_SD_M = 1.0
"""Standard deviation of a range by radio, once its gain is known."""

GYROSCOPE: dict[str, Any] = {
    "samples": 500,
    "landmark_samples": 300,
    "range_gain_sd": 0.1,
    "speed_gain_sd": 0.02,
    "turn_gain_sd": 0.01,
    "drift_rad_per_m": 0.001,
    "closure_spacing_s": 10.0,
    "landmark_jitter_m": 0.03,
}
"""A robot that measures its turns by a gyroscope, and drives tens of metres among radios that
nobody calibrated.
"""

NO_BEARING_RAD = 7.0
"""Standard deviation of a bearing that nobody knows: the most that a percept may have."""


def opened(folder: Path, config: Config) -> LandmarkLog:
    """Open the log of a robot among beacons. Raises UsageError if it cannot be played."""
    recorded = plaza.read(folder)
    odometry = speeds(recorded.odometry)
    begin_s, end_s = odometry[[0, -1], 0].tolist()
    every = recorded.ranges
    seen = every[(every[:, 0] >= begin_s) & (every[:, 0] <= end_s)]
    numbers = seen[:, 1].astype(np.int64).tolist()
    check_landmarks(numbers, folder, "beacon")

    stamps_s, view_of = view_stamps(seen[:, 0], begin_s, end_s)
    percepts: list[dict[int, Percept]] = [{} for _ in stamps_s]
    for view, number, row in zip(view_of.tolist(), numbers, seen, strict=True):
        percepts[view].setdefault(number, _percept(number, float(row[2])))

    wheels = Wheels(odometry)
    bounds_s = [begin_s, *stamps_s.tolist()]
    motions = [wheels.rows(since, until) for since, until in pairwise(bounds_s)]
    return LandmarkLog(
        stamps_s=stamps_s,
        percepts=[list(each.values()) for each in percepts],
        motions=motions,
        true_poses=poses_of(poses_at(recorded.truth, stamps_s)),
        surveyed={label_of(number): where for number, where in recorded.beacons.items()},
        settings=of_points(**GYROSCOPE),
        notes=notes_of_order(recorded.out_of_order),
    )


def label_of(number: int) -> str:
    """Return the name of a beacon."""
    return f"beacon-{number}"


def speeds(odometry: Floats) -> Floats:
    """Return the speeds from each stamp to the next, (n, 3), of (n, 3) distances and turns since
    the stamp before.
    """
    stamps_s = odometry[:, 0]
    rates = odometry[1:, 1:] / np.diff(stamps_s)[:, None]
    at_rest = np.zeros((1, 2))
    return np.column_stack([stamps_s, np.concatenate([rates, at_rest])])


def _percept(number: int, range_m: float) -> Percept:
    """Make a percept of a beacon at a range, in whatever direction."""
    return sighting(
        label_of(number),
        0.0,
        range_m,
        bearing_sd_rad=NO_BEARING_RAD,
        range_sd_m=RANGE_SD_M,
    )
