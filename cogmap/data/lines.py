"""Where in a file something is wrong."""

from __future__ import annotations

from pathlib import Path

from cogmap.errors import UsageError


def wrong_line(path: Path, number: int, line: str, expected: str) -> UsageError:
    """The error for line `number`, counted from 1, of the file at `path`, where `expected` should
    stand.
    """
    shown = line.strip()
    shown = shown if len(shown) <= 60 else f"{shown[:60]}…"
    return UsageError(f"{path}, line {number}: expected {expected}, got '{shown}'")
