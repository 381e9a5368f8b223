"""Logs of a car among trees: Victoria Park, or others in the same files.

Guivant and Nebot (2002), "Simultaneous localization and map building: test case for outdoor
applications". A laser scanner finds the trunks; nothing says which tree each is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cogmap.data.csv_columns import Columns, in_order, table, table_by_time
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

GIVE = "the folder of a log with trees, such as victoria_park"
# The scanner stands before and left of the middle of the rear axle, which odometry is of: from the
# data set's description.
LASER_AHEAD_M = 3.78
LASER_LEFT_M = 0.5

_ODOMETRY = Columns("odometry.csv", ("t_s", "speed_m_s", "turn_rate_rad_s"))
_TREES = Columns(
    "trees.csv",
    ("t_s", "range_m", "bearing_rad", "diameter_m"),
    positive=("range_m", "diameter_m"),
)
_GPS = Columns("gps.csv", ("t_s", "x_m", "y_m"))


@dataclass(frozen=True, eq=False)
class TreeLog:
    """One log, each part in order of time, stamps in seconds of one clock.

    `odometry`: (n, 3) stamp, forward speed of the rear axle in m/s, turn rate in rad/s. `trees`:
    (n, 4) stamp, range_m and bearing_rad of a trunk from the laser, left positive, diameter_m; of a
    scan all have one stamp. `gps`: (n, 3) stamp, x_m, y_m, with gaps and jumps: for evaluation
    only. `out_of_order`: how many trunks came with a stamp before that of an earlier line.
    """

    name: str
    odometry: Floats
    trees: Floats
    gps: Floats
    out_of_order: int

    @property
    def trees_from_axle(self) -> Floats:
        """Return `trees` as seen from the middle of the rear axle, where the pose is."""
        stamp_s, range_m, bearing_rad, diameter_m = self.trees.T
        ahead_m = LASER_AHEAD_M + range_m * np.cos(bearing_rad)
        left_m = LASER_LEFT_M + range_m * np.sin(bearing_rad)

        from_axle_m = np.hypot(ahead_m, left_m)
        from_axle_rad = np.arctan2(left_m, ahead_m)
        return np.column_stack([stamp_s, from_axle_m, from_axle_rad, diameter_m])


def read(folder: Path) -> TreeLog:
    """Return the log in `folder`. Raises UsageError naming a file that is missing, or the line that
    is wrong.
    """
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}: give {GIVE}")

    odometry = table_by_time(folder, _ODOMETRY, GIVE)
    trees, out_of_order = in_order(table(folder, _TREES, GIVE))
    gps, _ = in_order(table(folder, _GPS, GIVE))
    return TreeLog(folder.name, odometry, trees, gps, out_of_order)
