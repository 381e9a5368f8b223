"""What SQLite reports becomes one sentence, with a remedy."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cogmap.errors import StorageError

# SQLite's extended codes have the primary code in their lowest byte.
PRIMARY = 0xFF
IN_USE = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
UNWRITABLE = (
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
        # SQLite's primary code; an error that Python itself cannot decode has none, and is damage.
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & PRIMARY
        if code in IN_USE:
            raise StorageError(
                f"{path} is in use by another process: end that first, or name another file"
            ) from None
        if code in UNWRITABLE:
            raise StorageError(
                f"cannot write {path} ({error}): make room on its disk, or name another folder"
            ) from None
        if code == sqlite3.SQLITE_NOTADB:
            raise StorageError(
                f"{path} is no SQLite database: name another file, or move it away to start anew"
            ) from None
        raise damaged(path, str(error)) from None


def damaged(path: Path, what: str) -> StorageError:
    """Return the error for a file that does not hold what was written to it."""
    return StorageError(
        f"{path} is damaged ({what}): move it away to start anew, "
        f"or to make it again from an export by `cogmap memory import`"
    )
