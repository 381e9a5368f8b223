"""UTIAS MRCLAM folders: robots that drive among landmarks, each with odometry and sightings of
barcodes.

Leung, Halpern, Barfoot and Liu (2011), doi 10.1177/0278364911398404. Files are whitespace-separated
numbers with `#` comments, as published, or packed with xz (`.dat.xz`).
"""

from __future__ import annotations

import io
import lzma
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cogmap.data.lines import wrong_line
from cogmap.errors import UsageError

Numbers = npt.NDArray[np.float64]
ROBOTS = range(1, 6)


@dataclass(frozen=True)
class Robot:
    """One robot's log, each in order of time, stamps in seconds of one clock.

    `odometry`: (n, 3) stamp, forward speed in m/s, turn rate in rad/s. `sightings`: (n, 4) stamp,
    subject, range_m, bearing_rad, left positive. `truth`: (n, 4) stamp, x_m, y_m, heading_rad, from
    motion capture: for judges only. `unread`: how many sightings had a barcode that is nobody's,
    and were left out.
    """

    number: int
    odometry: Numbers
    sightings: Numbers
    truth: Numbers
    unread: int

    @property
    def landmark_sightings(self) -> Numbers:
        """Those sightings that are not of robots."""
        return self.sightings[self.sightings[:, 1] > ROBOTS[-1]]


@dataclass(frozen=True)
class Recording:
    """A set: its robots, and the surveyed positions (x_m, y_m) of its landmarks by subject number."""

    name: str
    robots: list[Robot]
    landmarks: dict[int, tuple[float, float]]


def read(folder: Path) -> Recording:
    """The set in `folder`. Raises UsageError naming a file that is missing, or the line that is
    wrong.
    """
    if not folder.is_dir():
        raise UsageError(
            f"there is no folder {folder}: give one with an MRCLAM set, such as MRCLAM_Dataset6"
        )
    barcodes = _table(folder, "Barcodes", 2, "a subject and its barcode")
    subject_of = {int(barcode): int(subject) for subject, barcode in barcodes}
    rows = _table(
        folder, "Landmark_Groundtruth", 5, "a subject, x, y and their standard deviations"
    )
    landmarks = {int(row[0]): (float(row[1]), float(row[2])) for row in rows}
    found = [n for n in ROBOTS if _path(folder, f"Robot{n}_Odometry") is not None]
    if not found:
        raise UsageError(f"{folder} has no Robot1_Odometry.dat: give the folder of an MRCLAM set")
    return Recording(
        folder.name, [_robot(folder, number, subject_of) for number in found], landmarks
    )


def _robot(folder: Path, number: int, subject_of: dict[int, int]) -> Robot:
    name = f"Robot{number}"
    odometry = _table(folder, f"{name}_Odometry", 3, "a time, a speed and a turn rate")
    seen = _table(
        folder,
        f"{name}_Measurement",
        4,
        "a time, a barcode, a range above 0 and a bearing",
        positive=2,
    )
    truth = _table(folder, f"{name}_Groundtruth", 4, "a time, x, y and a heading")
    subjects = np.array([subject_of.get(int(barcode), 0) for barcode in seen[:, 1]])
    sightings = np.column_stack([seen[:, 0], subjects, seen[:, 2:]])[subjects > 0]
    return Robot(
        number, _by_time(odometry), _by_time(sightings), _by_time(truth), int((subjects == 0).sum())
    )


def _by_time(rows: Numbers) -> Numbers:
    return rows[np.argsort(rows[:, 0], kind="stable")]


def _path(folder: Path, name: str) -> Path | None:
    paths = (folder / f"{name}.dat", folder / f"{name}.dat.xz")
    return next((path for path in paths if path.is_file()), None)


def _table(
    folder: Path, name: str, columns: int, expected: str, positive: int | None = None
) -> Numbers:
    """The numbers in a file, (n, columns), the column `positive` above 0."""
    path = _path(folder, name)
    if path is None:
        raise UsageError(
            f"{folder} has no {name}.dat: give the folder of an MRCLAM set, with every file in it"
        )
    text = _text(path)
    if not any(line.partition("#")[0].strip() for line in text.splitlines()):
        raise UsageError(f"{path} has no line with {expected}")
    try:
        rows = np.loadtxt(io.StringIO(text), comments="#", ndmin=2)
    except ValueError:
        rows = np.empty((0, 0))
    if (
        rows.shape[1:] == (columns,)
        and np.isfinite(rows).all()
        and (positive is None or (rows[:, positive] > 0).all())
    ):
        return rows
    for number, line in enumerate(text.splitlines(), 1):
        content = line.partition("#")[0].split()
        if content and not _fits(content, columns, positive):
            raise wrong_line(path, number, line, expected)
    raise UsageError(f"{path} has lines that are not {expected}")


def _text(path: Path) -> str:
    try:
        raw = path.read_bytes()
        return (lzma.decompress(raw) if path.suffix == ".xz" else raw).decode()
    except (OSError, lzma.LZMAError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from None


def _fits(content: list[str], columns: int, positive: int | None) -> bool:
    number = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
    if len(content) != columns or not all(number.fullmatch(word) for word in content):
        return False
    values = [float(word) for word in content]
    return bool(np.isfinite(values).all()) and (positive is None or values[positive] > 0)
