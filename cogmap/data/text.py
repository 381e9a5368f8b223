"""Text files of a user, line by line: plain or packed by gzip, bzip2 or xz, in UTF-8 or Latin-1."""

from __future__ import annotations

import codecs
import csv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, NamedTuple

from cogmap.errors import UsageError
from cogmap.files.packed import DAMAGE, SUFFIXES, opened

PACKED = SUFFIXES
MAX_SHOWN = 60
MAX_DIGITS = 30
MAX_NUMBER = 1 << 63
NS_PER_S = 1_000_000_000


class Line(NamedTuple):
    """A line of a file without its end, and its number, counted from 1."""

    path: Path
    number: int
    text: str

    def wrong(self, expected: str, remedy: str = "") -> UsageError:
        """Make the error for a line that is not as `expected`; `remedy` is what to do about it."""
        shown = self.text.strip()
        if len(shown) > MAX_SHOWN:
            shown = f"{shown[:MAX_SHOWN]}…"

        sentence = f"{self.path}, line {self.number}: expected {expected}, got '{shown}'"
        return UsageError(f"{sentence}: {remedy}" if remedy else sentence)


def numbered_lines(path: Path, give: str) -> Iterator[Line]:
    """Yield the lines of a file, unpacked, without a byte-order mark.

    Raises UsageError if it cannot be read, with the remedy to give `give`; BoundError if it holds
    more than a file may.
    """
    with _opened(path, give) as file:
        for number, line in enumerate(file, start=1):
            content = line.removeprefix(codecs.BOM_UTF8) if number == 1 else line
            try:
                text = content.decode()
            except UnicodeDecodeError:
                text = content.decode("latin-1")
            yield Line(path, number, text.rstrip("\r\n"))


def cells_of(line: Line) -> list[str]:
    """Return the cells of a line of CSV. Raises UsageError if it is none."""
    try:
        return next(csv.reader([line.text]), [])
    except csv.Error as error:
        raise line.wrong(f"cells that commas part ({error})") from None


def number_of(word: str) -> int | None:
    """Return the whole number of at most 63 bits that a word is; None if it is none."""
    if not word.isdecimal() or len(word) > MAX_DIGITS:
        return None
    number = int(word)
    return number if number < MAX_NUMBER else None


def time_ns_of(line: Line) -> int:
    """Return the time that a line states in seconds, in ns. Raises UsageError if it is none, or
    takes more than 63 bits.
    """
    try:
        time_ns = round(float(line.text) * NS_PER_S)
    except (ValueError, OverflowError):
        time_ns = MAX_NUMBER
    if abs(time_ns) >= MAX_NUMBER:
        raise line.wrong("a time in seconds")
    return time_ns


def read_bytes(path: Path, give: str) -> bytes:
    """Return the content of a file, unpacked. Raises UsageError as `numbered_lines` does."""
    with _opened(path, give) as file:
        return file.read()


def plain_or_packed(folder: Path, name: str) -> Path | None:
    """Find a file by its name in a folder, plain or packed; None if there is none."""
    for suffix in PACKED:
        path = folder / f"{name}{suffix}"
        if path.is_file():
            return path
    return None


@contextmanager
def _opened(path: Path, give: str) -> Iterator[IO[bytes]]:
    try:
        with opened(path) as file:
            yield file
    except FileNotFoundError:
        raise UsageError(f"there is no file {path}: give {give}") from None
    except DAMAGE as error:
        raise UsageError(f"{path} cannot be read ({error}): give {give}, all of it") from error
