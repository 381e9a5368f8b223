"""UTIAS MRCLAM folders: robots that drive among landmarks, each with odometry and observations of
barcodes.

Leung, Halpern, Barfoot and Liu (2011), doi 10.1177/0278364911398404. Files are whitespace-separated
numbers with `#` comments, as published, or packed.
"""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import numbered_lines, plain_or_packed
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

ROBOTS = range(1, 6)
GIVE = "the file of an MRCLAM set"


@dataclass(frozen=True)
class Robot:
    """One robot's log, each part in order of time, stamps in seconds of one clock.

    `odometry`: (n, 3) stamp, forward speed in m/s, turn rate in rad/s. `observations`: (n, 4)
    stamp, subject, range_m, bearing_rad, left positive. `truth`: (n, 4) stamp, x_m, y_m,
    heading_rad, from motion capture: for evaluation only. `unread`: how many observations were of a
    barcode that belongs to no subject, and were left out.
    """

    number: int
    odometry: Floats
    observations: Floats
    truth: Floats
    unread: int

    @property
    def landmark_observations(self) -> Floats:
        """Return the observations that are not of robots."""
        subjects = self.observations[:, 1]
        is_landmark = subjects > ROBOTS[-1]
        return self.observations[is_landmark]


@dataclass(frozen=True)
class Recording:
    """A set: its robots, and the surveyed positions (x_m, y_m) of its landmarks by subject."""

    name: str
    robots: list[Robot]
    landmarks: dict[int, tuple[float, float]]


class _Columns(NamedTuple):
    """What a line of a file holds: how many numbers, and which of them must be above 0, if any."""

    number: int
    expected: str
    positive: int | None = None

    def fit(self, rows: Floats) -> bool:
        """Decide whether (n, columns) rows are such numbers."""
        if rows.shape[1] != self.number or not np.isfinite(rows).all():
            return False
        return self.positive is None or bool((rows[:, self.positive] > 0).all())


_BARCODES = _Columns(2, "a subject and its barcode")
_LANDMARKS = _Columns(5, "a subject, x, y and their standard deviations")
_ODOMETRY = _Columns(3, "a time, a speed and a turn rate")
_OBSERVATIONS = _Columns(4, "a time, a barcode, a range above 0 and a bearing", positive=2)
_TRUTH = _Columns(4, "a time, x, y and a heading")


def read(folder: Path) -> Recording:
    """Return the set in `folder`. Raises UsageError naming a file that is missing, or the line that
    is wrong.
    """
    if not folder.is_dir():
        raise UsageError(
            f"there is no folder {folder}: give one with an MRCLAM set, such as MRCLAM_Dataset6"
        )
    barcodes = _table(folder, "Barcodes", _BARCODES)
    subject_of = {int(barcode): int(subject) for subject, barcode in barcodes}
    landmarks = {}
    for subject, x_m, y_m, *_ in _table(folder, "Landmark_Groundtruth", _LANDMARKS).tolist():
        landmarks[int(subject)] = (x_m, y_m)

    numbers = [n for n in ROBOTS if plain_or_packed(folder, f"Robot{n}_Odometry.dat")]
    if not numbers:
        raise UsageError(f"{folder} has no Robot1_Odometry.dat: give the folder of an MRCLAM set")

    robots = []
    for number in numbers:
        odometry = _table(folder, f"Robot{number}_Odometry", _ODOMETRY)
        measured = _table(folder, f"Robot{number}_Measurement", _OBSERVATIONS)
        truth = _table(folder, f"Robot{number}_Groundtruth", _TRUTH)

        subjects = np.array([subject_of.get(int(barcode), 0) for barcode in measured[:, 1]])
        observations = np.column_stack([measured[:, 0], subjects, measured[:, 2:]])
        is_known = subjects > 0
        robot = Robot(
            number,
            odometry=_by_time(odometry),
            observations=_by_time(observations[is_known]),
            truth=_by_time(truth),
            unread=int((~is_known).sum()),
        )
        robots.append(robot)

    return Recording(folder.name, robots, landmarks)


def _by_time(rows: Floats) -> Floats:
    stamps = rows[:, 0]
    order = np.argsort(stamps, kind="stable")
    return rows[order]


def _table(folder: Path, name: str, columns: _Columns) -> Floats:
    """Read the numbers in a file, (n, columns). Raises UsageError."""
    path = plain_or_packed(folder, f"{name}.dat")
    if path is None:
        raise UsageError(
            f"{folder} has no {name}.dat: give the folder of an MRCLAM set, with every file in it"
        )

    lines = [*numbered_lines(path, GIVE)]
    rows = _parsed("\n".join(line.text for line in lines))
    if not len(rows):
        raise UsageError(f"{path} has no line with {columns.expected}: give the whole file")
    if not columns.fit(rows):
        for line in lines:
            content, _, _ = line.text.partition("#")
            if content.strip() and not columns.fit(_parsed(content)):
                raise line.wrong(columns.expected)
    return rows


def _parsed(text: str) -> Floats:
    """Parse lines of numbers, (n, columns); an array of no columns if they are none."""
    try:
        with warnings.catch_warnings(action="ignore"):  # that there is no line, which is checked
            return np.loadtxt(io.StringIO(text), comments="#", ndmin=2)
    except ValueError:
        return np.empty((1, 0))
