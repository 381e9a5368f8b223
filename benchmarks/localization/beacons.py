"""A robot among beacons that it hears at a range, without a bearing: the path that it finds, and
that of gtsam's batch.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks import optional
from benchmarks.localization import range_batch
from benchmarks.localization.drives import ORIGIN, SEEDS, follow
from benchmarks.localization.senses import NOISE, STAMP_DECIMALS, Moment
from benchmarks.report import Metrics
from benchmarks.threshold import Thresholds, at_most
from cogmap.cli.progress import bar
from cogmap.data.plaza import RangeLog, read
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.player.public import sighting

THRESHOLDS: Thresholds = {"slam_rmse_over_gtsam": at_most(1.2)}
# What is assumed of a radio. By the surveyed beacons these scatter by 0.54 m about a gain of 7 %.
RANGE_SD_M = 1.0
UNKNOWN_BEARING_SD_RAD = float(np.pi)
MIN_BEACONS = 2
# A robot that measures its turns by a gyroscope, and drives tens of metres among radios that nobody
# calibrated.
SETTINGS = {
    "samples": 500,
    "landmark_samples": 300,
    "range_gain_sd": 0.1,
    "speed_gain_sd": 0.02,
    "turn_gain_sd": 0.01,
    "drift_rad_per_m": 0.001,
    "path_spacing_m": 1.0,
    "path_variance_per_m": 1e-3,
    "heading_variance_per_m": 1e-5,
    "heading_variance_per_rad": 1e-4,
    "closure_spacing_s": 10.0,
    "landmark_jitter_m": 0.03,
}


def measure(folder: Path) -> Metrics:
    """Measure a robot's path by ranges alone, on a map that it makes, beside gtsam's batch on the
    same ranges and motions. Raises UsageError if the log has ranges to one beacon alone.
    """
    optional.gtsam()
    log = read(folder)
    heard = np.unique(log.ranges[:, 1])
    if len(heard) < MIN_BEACONS:
        raise UsageError(
            f"{folder} has ranges to one beacon alone, by which no place can be told from those "
            "around it: give a log with two beacons or more"
        )

    sensed = list(moments(log))
    stamps_s = np.array([moment.stamp_s for moment in sensed])
    truth_m = _truth_m(log, stamps_s)
    drives = []
    with bar("drives among beacons") as progress:
        for number, seed in enumerate(SEEDS):

            def show(share: float, before: int = number) -> None:
                progress((before + share) / len(SEEDS))

            drives.append(follow(sensed, {}, ORIGIN, seed, settings=SETTINGS, progress=show))

    with bar("gtsam's batches") as progress:
        plain_m, calibrated_m = range_batch.solve(sensed, progress)

    slam_m = []
    online_m = []
    for drive in drives:
        path_m = drive.corrected(stamps_s)[:, :2]
        slam_m.append(optional.trajectory_error_m(path_m, truth_m))
        online_m.append(optional.trajectory_error_m(drive.online[:, :2], truth_m))

    plain_rmse_m = optional.trajectory_error_m(plain_m, truth_m)
    calibrated_rmse_m = optional.trajectory_error_m(calibrated_m, truth_m)
    slam_rmse_m = float(np.mean(slam_m))
    odometry_m = drives[0].odometry[:, :2]
    return {
        "slam_rmse_over_gtsam": slam_rmse_m / min(plain_rmse_m, calibrated_rmse_m),
        "slam_rmse_m": slam_rmse_m,
        "slam_online_rmse_m": float(np.mean(online_m)),
        "gtsam_rmse_m": plain_rmse_m,
        "gtsam_calibrated_rmse_m": calibrated_rmse_m,
        "path_integration_rmse_m": optional.trajectory_error_m(odometry_m, truth_m),
        "ranges": float(len(log.ranges)),
        "ranges_out_of_order": float(log.out_of_order),
        "late_answers": float(sum(drive.late_answers for drive in drives)),
    }


def moments(log: RangeLog) -> Iterator[Moment]:
    """Yield a log in order of time, a moment at each range that was heard."""
    begin_s, end_s = log.odometry[[0, -1], 0].tolist()
    is_inside = (log.ranges[:, 0] > begin_s) & (log.ranges[:, 0] <= end_s)
    ranges = log.ranges[is_inside]
    ranges[:, 0] = ranges[:, 0].round(STAMP_DECIMALS)

    moved_until_s = begin_s
    for stamp_s in np.unique(ranges[:, 0]).tolist():
        here = ranges[ranges[:, 0] == stamp_s]
        heard = {int(number): percept_of(int(number), range_m) for _, number, range_m in here}
        motions = _rows(log.odometry, moved_until_s, stamp_s)
        yield Moment(stamp_s, motions, list(heard.values()), True)
        moved_until_s = stamp_s


def percept_of(number: int, range_m: float) -> Percept:
    """Make a percept of a beacon at a range, in a direction that is unknown."""
    return sighting(
        f"beacon-{number}",
        0.0,
        range_m,
        bearing_sd_rad=UNKNOWN_BEARING_SD_RAD,
        range_sd_m=RANGE_SD_M,
    )


def _rows(odometry: Floats, since_s: float, until_s: float) -> Floats:
    """Return (n, 5) rows of self-motion in between, with the noise that sensory memory gives the
    town's wheels.
    """
    stamps_s = odometry[:, 0]
    first = int(np.searchsorted(stamps_s, since_s, "right"))
    last = int(np.searchsorted(stamps_s, until_s, "left"))
    ends_s = np.append(stamps_s[first:last], until_s)
    lasts_s = np.diff(np.append(since_s, ends_s))

    # Each line says what happened since the one before: a part of it is in the same proportion.
    rows = odometry[first : last + 1]
    whole_s = np.diff(stamps_s[first - 1 : last + 1])
    speed = rows[:, 1] / whole_s
    turn_rate = rows[:, 2] / whole_s

    speed_sd = NOISE.speed_noise * np.abs(speed) / np.sqrt(lasts_s)
    drift_variance = NOISE.drift_rad_per_sqrt_m**2 * np.abs(speed)
    turn_variance = (NOISE.turn_noise * turn_rate) ** 2 + drift_variance
    turn_sd = np.sqrt(turn_variance / lasts_s)
    return np.column_stack([speed, turn_rate, lasts_s, speed_sd, turn_sd])


def _truth_m(log: RangeLog, stamps_s: Floats) -> Floats:
    """Interpolate the true positions, (n, 2)."""
    at_s = log.truth[:, 0]
    columns = [np.interp(stamps_s, at_s, log.truth[:, column]) for column in (1, 2)]
    return np.column_stack(columns)
