"""A robot of an MRCLAM set: posts with barcodes, which it saw by range and bearing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cogmap.data import mrclam
from cogmap.data.true_path import poses_at
from cogmap.errors import ConfigError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.schemas.sensing import Percept
from cogmap.services.player.config import Config
from cogmap.services.player.landmark_logs.delay import Delay
from cogmap.services.player.landmark_logs.settings import RANGE_SHARE, of_points
from cogmap.services.player.landmark_logs.sightings import sighting
from cogmap.services.player.landmark_logs.views import (
    LandmarkLog,
    check_landmarks,
    view_stamps,
)
from cogmap.services.player.landmark_logs.wheels import Wheels
from cogmap.services.player.recording import poses_of

BEARING_SD_RAD = float(np.deg2rad(1.0))
"""That of a bearing: a barcode covers some degrees of the picture, and is found to within one."""

MIN_COSINE = 0.1
"""Of a bearing in the picture: a camera does not see so far aside."""

PATH_SPACING_M = 0.3
"""Between places of the path: the hall is some metres wide."""


def opened(folder: Path, config: Config) -> LandmarkLog:
    """Open the robot that is configured. Raises UsageError if it cannot be played, and ConfigError
    if the set has no such robot.
    """
    recorded = mrclam.read(folder)
    robots = {robot.number: robot for robot in recorded.robots}
    if config.robot not in robots:
        numbers = ", ".join(map(str, robots))
        raise ConfigError(
            f"[player] robot is {config.robot}: {folder} has the robots {numbers}, choose one"
        )

    robot = robots[config.robot]
    begin_s, end_s = robot.odometry[[0, -1], 0].tolist()
    every = robot.landmark_observations
    observed = every[(every[:, 0] >= begin_s) & (every[:, 0] <= end_s)]
    subjects = observed[:, 1].astype(np.int64).tolist()
    check_landmarks(subjects, folder, "barcode")

    stamps_s, view_of = view_stamps(observed[:, 0], begin_s, end_s)
    seen: list[dict[int, Percept]] = [{} for _ in stamps_s]
    for view, subject, row in zip(view_of.tolist(), subjects, observed, strict=True):
        seen[view].setdefault(subject, _percept(row))  # of two that are read as one, the first

    surveyed = {label_of(subject): where for subject, where in recorded.landmarks.items()}
    return LandmarkLog(
        stamps_s=stamps_s,
        percepts=[list(each.values()) for each in seen],
        motions=_motions(Wheels(robot.odometry), observed, view_of, stamps_s),
        true_poses=poses_of(poses_at(robot.truth, stamps_s)),
        surveyed=surveyed,
        settings=of_points(path_spacing_m=PATH_SPACING_M),
        notes=_notes(robot),
    )


def _notes(robot: mrclam.Robot) -> list[str]:
    """Say what of a robot's observations is not played, if anything is not."""
    of_robots = len(robot.observations) - len(robot.landmark_observations)
    notes = []
    if robot.unread:
        notes.append(f"{robot.unread} observations of barcodes that nothing has are left out")
    if of_robots:
        notes.append(f"{of_robots} observations of other robots are left out")
    return notes


def label_of(subject: int) -> str:
    """Return the name of a landmark."""
    return f"landmark-{subject}"


def _percept(row: Floats) -> Percept:
    """Make a percept of an observation (stamp, subject, range, bearing).

    The range of a set is computed from the height of an upright barcode in the image: it is the
    depth along the camera's axis.
    """
    _, subject, depth_m, bearing_rad = row.tolist()
    range_m = depth_m / max(float(np.cos(bearing_rad)), MIN_COSINE)
    return sighting(
        label_of(int(subject)),
        bearing_rad,
        range_m,
        bearing_sd_rad=BEARING_SD_RAD,
        range_sd_m=RANGE_SHARE * range_m,
    )


def _motions(wheels: Wheels, observed: Floats, view_of: Indices, stamps_s: Floats) -> list[Floats]:
    """Return the self-motion until each view, (n, 5) rows.

    The log has commands: the wheels follow later, by what the views until then tell.
    """
    delay = Delay()
    ends = np.searchsorted(view_of, np.arange(len(stamps_s)), side="right").tolist()
    motions = []
    moved_until_s = float(stamps_s[0])
    first = 0
    for stamp_s, end in zip(stamps_s.tolist(), ends, strict=True):
        delay.observe(observed[first:end], wheels.heading_rad)
        first = end
        sensed_s = max(moved_until_s, stamp_s - delay.lag_s)
        motions.append(wheels.rows(moved_until_s, sensed_s))
        moved_until_s = sensed_s

    return motions
