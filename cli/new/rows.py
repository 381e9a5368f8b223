"""Rows that are added to tables in source files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from cogmap.errors import UsageError


class Row(NamedTuple):
    """A line, or several, and where it is added in a file: before the line that `find` names."""

    path: Path
    text: str
    find: Callable[[list[str]], int]

    def added_to(self, source: str) -> str:
        """Return `source` with the row in it. Raises UsageError if its place is not found."""
        lines = source.splitlines()
        try:
            at = self.find(lines)
        except StopIteration:
            raise UsageError(
                f"{self.path} is not as expected: add this row by hand: {self.text.strip()}"
            ) from None
        return "\n".join([*lines[:at], self.text, *lines[at:]]) + "\n"


def before(path: Path, start: str, text: str) -> Row:
    """Make a row before the first line that begins with `start`."""
    return Row(path, text, lambda lines: _first(lines, start))


def at_end_of(path: Path, start: str, text: str) -> Row:
    """Make the last row of the table whose first line begins with `start`."""

    def end(lines: list[str]) -> int:
        first = _first(lines, start)
        return next(at for at in range(first, len(lines)) if lines[at] in {")", "}", "]"})

    return Row(path, text, end)


def in_list(path: Path, neighbour: str, text: str) -> Row:
    """Make a row after the first line that is `neighbour`, however it is indented."""

    def after(lines: list[str]) -> int:
        return next(at for at, line in enumerate(lines) if line.strip() == neighbour) + 1

    return Row(path, text, after)


def _first(lines: list[str], start: str) -> int:
    return next(at for at, line in enumerate(lines) if line.startswith(start))
