"""A car among trees: trunks without names, by range, bearing and diameter."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from cogmap.data import victoria_park
from cogmap.data.true_path import poses_at
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.player.config import Config
from cogmap.services.player.landmark_logs.settings import of_points
from cogmap.services.player.landmark_logs.sightings import sighting
from cogmap.services.player.landmark_logs.views import LandmarkLog, notes_of_order, view_stamps
from cogmap.services.player.landmark_logs.wheels import Wheels
from cogmap.services.player.recording import poses_of

NO_LABEL = ""
"""Nothing says which tree a trunk is of: that is to be found out."""

RANGE_SD_M = 0.3
BEARING_SD_RAD = float(np.deg2rad(1.0))
"""Standard deviations of a trunk's range and bearing: the stamps of scans are right to some 0.1 s,
in which the car drives 0.3 m and turns by a degree.
"""

COURSE_S = 1.0
COURSE_M = 1.0
"""The heading is that of the way from one second before to one after, if the car drove so far."""


def opened(folder: Path, config: Config) -> LandmarkLog:
    """Open the log of a car. Raises UsageError if it cannot be played."""
    recorded = victoria_park.read(folder)
    begin_s, end_s = recorded.odometry[[0, -1], 0].tolist()
    every = recorded.trees_from_axle
    seen = every[(every[:, 0] >= begin_s) & (every[:, 0] <= end_s)]
    if not len(seen):
        raise UsageError(f"{folder}: no tree was seen while it drove: give the whole log")
    if len(np.unique(seen[:, 1:], axis=0)) < 2:
        raise UsageError(
            f"{folder}: every line is of one trunk, which cannot be mapped by: give the log as it "
            "was recorded"
        )

    stamps_s, view_of = view_stamps(seen[:, 0], begin_s, end_s)
    percepts: list[list[Percept]] = [[] for _ in stamps_s]
    for view, row in zip(view_of.tolist(), seen, strict=True):
        percepts[view].append(_percept(row))

    wheels = Wheels(recorded.odometry)
    bounds_s = [begin_s, *stamps_s.tolist()]
    motions = [wheels.rows(since, until) for since, until in pairwise(bounds_s)]
    return LandmarkLog(
        stamps_s=stamps_s,
        percepts=percepts,
        motions=motions,
        true_poses=poses_of(poses_at(courses(recorded.gps), stamps_s)),
        surveyed={},
        settings=of_points(),
        notes=notes_of_order(recorded.out_of_order),
    )


def courses(gps: Floats) -> Floats:
    """Return (m, 4) stamps, positions and headings of (n, 3) stamps and positions by satellites,
    where the way around them shows which way the car went.
    """
    stamps_s = gps[:, 0]
    still = np.column_stack([gps, np.zeros(len(gps))])
    ahead_m = poses_at(still, stamps_s + COURSE_S)[:, :2]
    behind_m = poses_at(still, stamps_s - COURSE_S)[:, :2]
    x_m, y_m = (ahead_m - behind_m).T

    headings_rad = np.arctan2(y_m, x_m)
    has_moved = np.hypot(x_m, y_m) >= COURSE_M
    moving: Floats = np.column_stack([gps, headings_rad])[has_moved]
    return moving


def _percept(row: Floats) -> Percept:
    """Make a percept of a trunk (stamp, range, bearing, diameter), seen from the rear axle."""
    _, range_m, bearing_rad, diameter_m = row.tolist()
    return sighting(
        NO_LABEL,
        bearing_rad,
        range_m,
        bearing_sd_rad=BEARING_SD_RAD,
        range_sd_m=RANGE_SD_M,
        width_m=diameter_m,
    )
