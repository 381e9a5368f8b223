"""Where in a file something is wrong."""

from __future__ import annotations

from pathlib import Path

from cogmap.errors import UsageError

_MAX_SHOWN = 60


def wrong_line(path: Path, number: int, line: str, expected: str) -> UsageError:
    """The error for line `number`, counted from 1, of the file at `path`: not as `expected`."""
    shown = line.strip()
    if len(shown) > _MAX_SHOWN:
        shown = f"{shown[:_MAX_SHOWN]}…"

    place = f"{path}, line {number}"
    return UsageError(f"{place}: expected {expected}, got '{shown}'")
