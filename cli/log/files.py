"""Writes what a command leaves."""

from __future__ import annotations

from pathlib import Path

from cogmap.recording.storage.writer import cannot_write


def save(path: Path, content: bytes) -> None:
    """Write a file, in place of one that is there. Raises LogError with the remedy."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise cannot_write(path, error) from None
