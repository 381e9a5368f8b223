"""UTIAS MRCLAM folders: robots that drive among landmarks, each with odometry and observations of
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

from cogmap.data.lines import wrong_line
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

ROBOTS = range(1, 6)
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


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
        """The observations that are not of robots."""
        subjects = self.observations[:, 1]
        is_landmark = subjects > ROBOTS[-1]
        return self.observations[is_landmark]


@dataclass(frozen=True)
class Recording:
    """A set: its robots, and the surveyed positions (x_m, y_m) of its landmarks by subject."""

    name: str
    robots: list[Robot]
    landmarks: dict[int, tuple[float, float]]


@dataclass(frozen=True)
class _Columns:
    """What a line of a file holds: how many numbers, and which of them must be above 0, if any."""

    number: int
    expected: str
    positive: int | None = None

    def fit(self, rows: Floats) -> bool:
        """Whether an array (n, columns) holds such numbers."""
        if rows.shape[1:] != (self.number,):
            return False
        if not np.isfinite(rows).all():
            return False
        if self.positive is None:
            return True
        positive = rows[:, self.positive]
        return bool((positive > 0).all())

    def fit_words(self, words: list[str]) -> bool:
        """Whether the words of a line are such numbers."""
        for word in words:
            if not _NUMBER.fullmatch(word):
                return False
        values = [float(word) for word in words]
        return self.fit(np.array([values]))


_BARCODES = _Columns(2, "a subject and its barcode")
_LANDMARKS = _Columns(5, "a subject, x, y and their standard deviations")
_ODOMETRY = _Columns(3, "a time, a speed and a turn rate")
_OBSERVATIONS = _Columns(4, "a time, a barcode, a range above 0 and a bearing", positive=2)
_TRUTH = _Columns(4, "a time, x, y and a heading")


def read(folder: Path) -> Recording:
    """The set in `folder`. Raises UsageError naming a file that is missing, or the line that is
    wrong.
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

    numbers = [n for n in ROBOTS if _path(folder, f"Robot{n}_Odometry") is not None]
    if not numbers:
        raise UsageError(f"{folder} has no Robot1_Odometry.dat: give the folder of an MRCLAM set")

    robots = [_robot(folder, number, subject_of) for number in numbers]
    return Recording(folder.name, robots, landmarks)


def _robot(folder: Path, number: int, subject_of: dict[int, int]) -> Robot:
    name = f"Robot{number}"
    odometry = _table(folder, f"{name}_Odometry", _ODOMETRY)
    measured = _table(folder, f"{name}_Measurement", _OBSERVATIONS)
    truth = _table(folder, f"{name}_Groundtruth", _TRUTH)

    subjects = np.array([subject_of.get(int(barcode), 0) for barcode in measured[:, 1]])
    observations = np.column_stack([measured[:, 0], subjects, measured[:, 2:]])
    is_known = subjects > 0
    return Robot(
        number,
        odometry=_by_time(odometry),
        observations=_by_time(observations[is_known]),
        truth=_by_time(truth),
        unread=int((~is_known).sum()),
    )


def _by_time(rows: Floats) -> Floats:
    stamps = rows[:, 0]
    order = np.argsort(stamps, kind="stable")
    return rows[order]


def _path(folder: Path, name: str) -> Path | None:
    for path in (folder / f"{name}.dat", folder / f"{name}.dat.xz"):
        if path.is_file():
            return path
    return None


def _table(folder: Path, name: str, columns: _Columns) -> Floats:
    """The numbers in a file, (n, columns). Raises UsageError."""
    path = _path(folder, name)
    if path is None:
        raise UsageError(
            f"{folder} has no {name}.dat: give the folder of an MRCLAM set, with every file in it"
        )

    text = _text(path)
    contents = [line.partition("#")[0].split() for line in text.splitlines()]
    if not any(contents):
        raise UsageError(f"{path} has no line with {columns.expected}")
    try:
        rows: Floats = np.loadtxt(io.StringIO(text), comments="#", ndmin=2)
    except ValueError:
        rows = np.empty((0, 0))
    if columns.fit(rows):
        return rows
    raise _first_wrong(path, text.splitlines(), contents, columns)


def _first_wrong(
    path: Path, lines: list[str], contents: list[list[str]], columns: _Columns
) -> UsageError:
    """The error that names the first line whose content does not fit."""
    for number, (line, words) in enumerate(zip(lines, contents, strict=True), 1):
        if words and not columns.fit_words(words):
            return wrong_line(path, number, line, columns.expected)
    return UsageError(f"{path} has lines that are not {columns.expected}")


def _text(path: Path) -> str:
    try:
        raw = path.read_bytes()
        if path.suffix == ".xz":
            raw = lzma.decompress(raw)
        return raw.decode()
    except (OSError, lzma.LZMAError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from None
