"""Files of a module's state: what fails becomes one sentence."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from cogmap.errors import StorageError


def open_file(path: Path) -> int:
    """Return a descriptor to read and write the file at `path`, made if there is none.

    Raises StorageError.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise StorageError(
            f"cannot write {path} ({error.strerror}): name another folder with --state"
        ) from None


def write_at(path: Path, file: int, data: bytes, offset: int) -> None:
    """Write all of `data` at `offset` of `file`, which is open at `path`. Raises StorageError."""
    try:
        written = os.pwrite(file, data, offset)
        if written < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    except OSError as error:
        raise StorageError(
            f"cannot write {path} ({error.strerror}): make room on its disk, "
            f"or name another folder with --state"
        ) from None
