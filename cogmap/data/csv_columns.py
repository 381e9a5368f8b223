"""Tables of a user's log: CSV files of numbers under a line of column names, plain or packed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import Line, cells_of, numbered_lines, plain_or_packed
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats


class Columns(NamedTuple):
    """What a file holds: its name, the names of its columns, and which of these must be above 0.

    The first is `t_s` in the tables that are in order of time.
    """

    file: str
    names: tuple[str, ...]
    positive: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        """Say what a line must be."""
        names = ", ".join(self.names)
        limits = "".join(f", {name} above 0" for name in self.positive)
        return f"{len(self.names)} numbers ({names}){limits}"

    def fit(self, row: list[float]) -> bool:
        """Decide whether a row is such numbers."""
        if len(row) != len(self.names) or not all(map(math.isfinite, row)):
            return False
        return all(row[self.names.index(name)] > 0 for name in self.positive)


def table(folder: Path, columns: Columns, give: str) -> Floats:
    """Return the numbers in a file of `folder`, (n, columns), as they stand.

    Raises UsageError with the remedy to give `give`: if the file is missing or empty, or naming the
    first line that is wrong.
    """
    path = plain_or_packed(folder, columns.file)
    if path is None:
        raise UsageError(f"{folder} has no {columns.file}: give {give}, with every file in it")

    lines = numbered_lines(path, give)
    _check_names(path, lines, columns)
    rows = [_row(line, columns) for line in lines if line.text.strip()]
    if not rows:
        raise UsageError(f"{path} has no line but its first: give the whole file")
    return np.array(rows)


def table_by_time(folder: Path, columns: Columns, give: str) -> Floats:
    """Return the same of a file whose stamps must rise. Raises UsageError also where one does not.

    Each line says what happened since the one before, so that they cannot be put in order.
    """
    rows = table(folder, columns, give)
    falls = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(falls):
        before_s, stamp_s = rows[falls[0] : falls[0] + 2, 0].tolist()
        raise UsageError(
            f"{folder / columns.file} goes from {before_s:.3f} s to {stamp_s:.3f} s: give a log of "
            "one clock, whose stamps rise from line to line"
        )
    return rows


def in_order(rows: Floats) -> tuple[Floats, int]:
    """Return (n, columns) rows by the stamps in their first column, and how many came after a later
    one.
    """
    stamps_s = rows[:, 0]
    latest_s = np.maximum.accumulate(stamps_s)
    order = np.argsort(stamps_s, kind="stable")
    return rows[order], int((stamps_s < latest_s).sum())


def _check_names(path: Path, lines: Iterator[Line], columns: Columns) -> None:
    first = next(lines, Line(path, 1, ""))
    names = tuple(name.strip() for name in first.text.split(","))
    if names != columns.names:
        raise first.wrong(f"the names {','.join(columns.names)}")


def _row(line: Line, columns: Columns) -> list[float]:
    """Read the numbers of a line. Raises UsageError."""
    try:
        row = [float(cell) for cell in cells_of(line)]
    except ValueError:
        row = []

    if not columns.fit(row):
        raise line.wrong(columns.expected)
    return row
