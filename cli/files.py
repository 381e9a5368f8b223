"""Checks the names of files that commands read and write."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cogmap.errors import UsageError
from cogmap.recording.storage.writer import cannot_write


def check_picture(option: str, path: Path, suffixes: Sequence[str]) -> None:
    """Raise UsageError if `path`, given by `option`, has none of `suffixes`, or no folder."""
    if path.suffix.lower() not in suffixes:
        raise UsageError(f"{option} {path}: name a file that ends in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise UsageError(f"{option} {path}: there is no folder {path.parent}: make it first")


def save(path: Path, content: bytes) -> None:
    """Write a file, in place of one that is there. Raises LogError with the remedy."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise cannot_write(path, error) from None
