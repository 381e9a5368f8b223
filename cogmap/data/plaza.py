"""Logs of a robot among radio beacons: Plaza 1 and 2, or others in the same files.

Djugash, Hamner and Roth (2009), "Navigating with ranging radios: five data sets with ground truth".
Each measurement is the range to a beacon whose number is known, without a bearing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cogmap.data.csv_columns import Columns, in_order, table, table_by_time
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

GIVE = "the folder of a log with ranges to beacons, such as plaza1"

_ODOMETRY = Columns("odometry.csv", ("t_s", "distance_m", "turn_rad"))
_RANGES = Columns("ranges.csv", ("t_s", "beacon", "range_m"), positive=("range_m",))
_TRUTH = Columns("truth.csv", ("t_s", "x_m", "y_m", "heading_rad"))
_BEACONS = Columns("beacons.csv", ("beacon", "x_m", "y_m"))


@dataclass(frozen=True, eq=False)
class RangeLog:
    """One log, each part in order of time, stamps in seconds of one clock.

    `odometry`: (n, 3) stamp, distance in m and turn in rad since the stamp before. `ranges`: (n, 3)
    stamp, number of the beacon, range_m. `truth`: (n, 4) stamp, x_m, y_m, heading_rad; `beacons`:
    surveyed x_m, y_m by number; both for evaluation only. `out_of_order`: how many ranges came with
    a stamp before that of an earlier line.
    """

    name: str
    odometry: Floats
    ranges: Floats
    truth: Floats
    beacons: dict[int, tuple[float, float]]
    out_of_order: int


def read(folder: Path) -> RangeLog:
    """Return the log in `folder`. Raises UsageError naming a file that is missing, or the line that
    is wrong.
    """
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}: give {GIVE}")

    odometry = table_by_time(folder, _ODOMETRY, GIVE)
    ranges, out_of_order = in_order(table(folder, _RANGES, GIVE))
    truth = table_by_time(folder, _TRUTH, GIVE)

    beacons = {}
    for number, x_m, y_m in table(folder, _BEACONS, GIVE).tolist():
        beacons[int(number)] = (x_m, y_m)

    return RangeLog(folder.name, odometry, ranges, truth, beacons, out_of_order)
