"""What SQLite reports becomes one sentence, with a remedy."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cogmap.errors import StorageError

_PRIMARY = 0xFF
_IN_USE = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_UNWRITABLE = (
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_NOMEM,
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_TOOBIG,
)


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Raise StorageError about the database at `path` for what SQLite raises in the block."""
    try:
        yield
    except sqlite3.ProgrammingError:
        raise
    except sqlite3.Error as error:
        raise _sentence(path, error) from None


def damaged(path: Path, what: str) -> StorageError:
    """The error for a file that does not hold what was written to it."""
    return StorageError(
        f"{path} is damaged ({what}): move it away to start anew, "
        f"or to make it again from an export by `cogmap memory import`"
    )


def _sentence(path: Path, error: sqlite3.Error) -> StorageError:
    """By SQLite's primary code; what Python itself cannot decode has none, and is damaged."""
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & _PRIMARY
    if code in _IN_USE:
        return StorageError(
            f"{path} is in use by another process: end that first, or name another file"
        )
    if code in _UNWRITABLE:
        return StorageError(
            f"cannot write {path} ({error}): make room on its disk, or name another folder"
        )
    if code == sqlite3.SQLITE_NOTADB:
        return StorageError(
            f"{path} is no SQLite database: move it away to start anew, or name another file"
        )
    return damaged(path, str(error))
