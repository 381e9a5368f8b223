"""A file that appears whole, or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from cogmap.errors import StorageError


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield where to write a file that is to be at `path`: in a folder of its own beside it.

    When the block has ended, the file is at `path`, whole and on the disk. If the block raises or
    the process is killed, nothing is there. Raises StorageError if there is a file already, which
    stays, and if the disk refuses.
    """
    if path.exists():
        raise StorageError(f"{path} exists already: move it away, or name another file")

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
            made = Path(folder) / path.name
            yield made
            _sync(made)
            os.link(made, path)
        _sync(path.parent)
    except OSError as error:
        raise StorageError(
            f"cannot write {path} ({error.strerror}): make room on its disk, or name another folder"
        ) from None


def _sync(path: Path) -> None:
    """Put a file, or the names in a folder, on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
