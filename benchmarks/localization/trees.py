"""A car among trees that nobody named: the path that it finds, and that of gtsam with
nearest-neighbour association.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks import optional
from benchmarks.localization import gps
from benchmarks.localization.drives import ORIGIN, follow
from benchmarks.localization.nearest_neighbour import NearestNeighbour
from benchmarks.localization.senses import NOISE, Moment
from benchmarks.localization.smoother import step_of
from benchmarks.report import Metrics
from benchmarks.threshold import Thresholds, at_most
from cogmap.cli.progress import bar
from cogmap.data.victoria_park import LASER_AHEAD_M, LASER_LEFT_M, TreeLog, read
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose
from cogmap.schemas.sensing import Percept
from cogmap.services.player.public import sighting

THRESHOLDS: Thresholds = {
    "gps_rmse_over_gtsam": at_most(1.0),
    "gps_rmse_over_odometry": at_most(0.2),
}
# GPS's antenna stands about where the laser does, which nobody wrote down: fitted to three minutes,
# gtsam's path has it 4.1 m before and 0.3 m left of the rear axle, the map's 4.1 and 0.3.
ANTENNA_M = (LASER_AHEAD_M, LASER_LEFT_M)
# A car: its wheels and steering are calibrated to some per cent, its laser to less than its noise.
SETTINGS = {
    "samples": 500,
    "landmark_samples": 200,
    "speed_gain_sd": 0.05,
    "turn_gain_sd": 0.05,
    "drift_rad_per_m": 0.002,
    "range_gain_sd": 0.0,
    "path_spacing_m": 1.0,
    "path_variance_per_m": 2.5e-3,
    "heading_variance_per_m": 1e-4,
    "heading_variance_per_rad": 2.5e-3,
    "landmark_jitter_m": 0.01,
}

# The stamps of scans are right to some 0.1 s: at the car's 2.9 m/s and 0.2 rad/s, 0.3 m and 1°.
RANGE_SD_M = 0.3
BEARING_SD_RAD = float(np.deg2rad(1.0))


def measure(folder: Path) -> Metrics:
    """Measure a car's path on a map of trees that it makes, against GPS, beside gtsam's incremental
    smoother on the same percepts, and beside path integration.
    """
    optional.gtsam()
    log = read(folder)
    sensed = list(moments(log))
    stamps_s = np.array([moment.stamp_s for moment in sensed])
    fixes = log.gps[(log.gps[:, 0] >= stamps_s[0]) & (log.gps[:, 0] <= stamps_s[-1])]

    peer = NearestNeighbour()
    with bar("gtsam among the trees") as progress:
        for number, moment in enumerate(sensed):
            peer.add(moment)
            progress(number / len(sensed))

    with bar("the drive among the trees") as progress:
        drive = follow(sensed, {}, ORIGIN, 0, settings=SETTINGS, progress=progress)

    paths = {
        "slam": drive.corrected(stamps_s),
        "gtsam": peer.path(),
        "online": drive.online,
        "odometry": _integrated(sensed),
    }
    errors = {}
    for name, path in paths.items():
        errors[name] = gps.errors_m(gps.at_fixes(stamps_s, path, fixes, ANTENNA_M), fixes[:, 1:])

    is_jump = gps.are_jumps([errors["slam"], errors["gtsam"]])
    rmse_m = {}
    for name, each_m in errors.items():
        rmse_m[name] = float(np.sqrt(np.square(each_m[~is_jump]).mean()))

    metrics = {
        "gps_rmse_over_gtsam": rmse_m["slam"] / rmse_m["gtsam"],
        "gps_rmse_over_odometry": rmse_m["slam"] / rmse_m["odometry"],
        "gps_left_out_share": float(is_jump.mean()),
        "individuals": float(drive.individuals),
        "gtsam_landmarks": float(peer.landmarks),
        "late_answers": float(drive.late_answers),
        "trunks_out_of_order": float(log.out_of_order),
    }
    return metrics | {f"{name}_gps_rmse_m": value for name, value in rmse_m.items()}


def _integrated(sensed: Sequence[Moment]) -> Floats:
    """Integrate the motions alone: (n, 3) poses at the moments."""
    pose = np.zeros(3)
    poses = []
    for moment in sensed:
        step, _ = step_of(moment.motions)
        pose = compose(pose, step)
        poses.append(pose)

    return np.array(poses)


def moments(log: TreeLog) -> Iterator[Moment]:
    """Yield a log in order of time, a moment at each scan."""
    begin_s, end_s = log.odometry[[0, -1], 0].tolist()
    trees = log.trees_from_axle
    trees = trees[(trees[:, 0] > begin_s) & (trees[:, 0] <= end_s)]

    stamps_s, firsts = np.unique(trees[:, 0], return_index=True)
    ends = np.append(firsts[1:], len(trees))
    moved_until_s = begin_s
    for stamp_s, first, end in zip(stamps_s.tolist(), firsts, ends, strict=True):
        motions = rows_of_speeds(log.odometry, moved_until_s, stamp_s)
        percepts = [percept_of(row) for row in trees[first:end]]
        yield Moment(stamp_s, motions, percepts, True)
        moved_until_s = stamp_s


def percept_of(row: Floats) -> Percept:
    """Make a percept of a trunk, which has no name: stamp, range, bearing, diameter."""
    _, range_m, bearing_rad, diameter_m = row.tolist()
    return sighting(
        "",
        bearing_rad,
        range_m,
        bearing_sd_rad=BEARING_SD_RAD,
        range_sd_m=RANGE_SD_M,
        width_m=diameter_m,
    )


def rows_of_speeds(odometry: Floats, since_s: float, until_s: float) -> Floats:
    """Return (n, 5) rows of self-motion in between from (m, 3) rows of stamp, speed and turn rate,
    each until the next, with the noise that sensory memory gives the town's wheels.
    """
    stamps_s = odometry[:, 0]
    first = max(0, int(np.searchsorted(stamps_s, since_s, "right")) - 1)
    last = max(first + 1, int(np.searchsorted(stamps_s, until_s, "left")))
    _, speed, turn_rate = odometry[first:last].T
    starts_s = np.append(since_s, stamps_s[first + 1 : last])
    lasts_s = np.diff(np.append(starts_s, until_s)).clip(1e-6)

    speed_sd = NOISE.speed_noise * np.abs(speed) / np.sqrt(lasts_s)
    drift_variance = NOISE.drift_rad_per_sqrt_m**2 * np.abs(speed)
    turn_variance = (NOISE.turn_noise * turn_rate) ** 2 + drift_variance
    turn_sd = np.sqrt(turn_variance / lasts_s)
    return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])
