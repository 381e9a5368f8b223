"""Opens the file of a database for one process alone, and checks all of it."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from cogmap.errors import StorageError
from cogmap.runtime.state import schema
from cogmap.runtime.state.failures import damaged, named
from cogmap.runtime.state.new_file import new_file
from cogmap.runtime.state.record import Record, Totals, digest_of

Progress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""

_PROGRESS_EVERY = 100
_PRAGMAS = (
    "PRAGMA locking_mode = EXCLUSIVE",
    "PRAGMA journal_mode = DELETE",
    "PRAGMA synchronous = EXTRA",
)


@contextmanager
def new_database(path: Path) -> Iterator[Path]:
    """Where to make a database that is to be at `path`, as `new_file` does: it has no record yet.

    A rollback journal that waits for it is refused, for SQLite would write that into it. Raises
    StorageError.
    """
    journal = path.with_name(f"{path.name}-journal")
    if journal.exists():
        raise StorageError(
            f"{journal} belongs to a database that is not beside it: move it to that, or away"
        )

    with new_file(path) as made:
        made.write_bytes(schema.empty_database())
        yield made


def opened(path: Path, progress: Progress) -> sqlite3.Connection:
    """The database at `path`, locked until it is closed, of the newest version and undamaged.

    A transaction that a killed process has left is rolled back first. The file is read through
    SQLite alone, for closing another descriptor of it would drop its locks. Raises StorageError.
    """
    if path.is_file() and path.stat().st_size == 0:
        raise damaged(path, "it is empty")

    with named(path), _decodable(path):
        connection = _connected(path)
        try:
            _lock(connection)
            _check(connection, path, progress)
            connection.execute("COMMIT")
        except BaseException:
            connection.close()
            raise

    return connection


def rows(connection: sqlite3.Connection, path: Path) -> Iterator[tuple[Record, bytes]]:
    """Records with their digests, by sequence number. Raises StorageError at one that is damaged.

    SQLite keeps no types, so they are checked as well.
    """
    columns = "key, sequence, kind, payload, digest"
    for row in connection.execute(f"SELECT {columns} FROM records ORDER BY sequence"):
        match row:
            case str(key), int(sequence), str(kind), bytes(payload), bytes(digest):
                record = Record(key, kind, payload)
                if digest_of(record, sequence) == digest:
                    yield record, digest
                    continue

        raise damaged(path, f"the record {row[0]!r} does not have its digest")


def totals(connection: sqlite3.Connection, path: Path) -> Totals:
    """What is kept of all records together. Raises StorageError where it is damaged."""
    match connection.execute("SELECT count, combined FROM meta").fetchall():
        case [(int(count), bytes(combined))]:
            return Totals(count, combined)

    raise damaged(path, "its number of records is missing")


@contextmanager
def _decodable(path: Path) -> Iterator[None]:
    """Raise StorageError where SQLite names, in an error, a table whose name is damaged."""
    try:
        yield
    except UnicodeDecodeError:
        raise damaged(path, "its text cannot be decoded") from None


def _connected(path: Path) -> sqlite3.Connection:
    """A connection to a file that is there; each transaction is begun and ended by us."""
    uri = f"{path.absolute().as_uri()}?mode=rw"
    return sqlite3.connect(uri, uri=True, timeout=0, isolation_level=None, check_same_thread=False)


def _lock(connection: sqlite3.Connection) -> None:
    """Keep every other process out, from here to the end of the connection."""
    for pragma in _PRAGMAS:
        connection.execute(pragma)

    connection.execute("BEGIN EXCLUSIVE")


def _check(connection: sqlite3.Connection, path: Path, progress: Progress) -> None:
    """Whose it is, its version, its pages, its tables, its records. Raises StorageError."""
    _check_owner(connection, path)
    _check_version(connection, path)
    _check_pages(connection, path)
    schema.upgrade(connection)
    if not schema.is_as_made(connection):
        raise damaged(path, "its tables are not those of its version")

    _check_writable(connection)
    _check_records(connection, path, progress)


def _check_owner(connection: sqlite3.Connection, path: Path) -> None:
    ((found,),) = connection.execute("PRAGMA application_id")
    if found != schema.APPLICATION_ID:
        raise StorageError(
            f"{path} is a database of another program (application_id {found}): "
            f"name another file, or move it away to start anew"
        )


def _check_version(connection: sqlite3.Connection, path: Path) -> None:
    found = schema.version_of(connection)
    if not 0 <= found <= schema.version():
        raise StorageError(
            f"{path} has version {found} of the tables, and this program knows up to "
            f"{schema.version()}: install the Cogmap that wrote it, or a newer one"
        )


def _check_pages(connection: sqlite3.Connection, path: Path) -> None:
    ((verdict,),) = connection.execute("PRAGMA integrity_check(1)")
    if verdict != "ok":
        raise damaged(path, str(verdict))


def _check_writable(connection: sqlite3.Connection) -> None:
    """Change nothing, which SQLite refuses where the file is read-only; the lock it grants."""
    connection.execute("UPDATE meta SET count = count WHERE false")


def _check_records(connection: sqlite3.Connection, path: Path, progress: Progress) -> None:
    expected = totals(connection, path)
    found = Totals()
    for _, digest in rows(connection, path):
        found = found.plus(digest)
        if found.count % _PROGRESS_EVERY == 0:
            progress(min(1.0, found.count / max(expected.count, 1)))

    if found.count != expected.count:
        raise damaged(path, f"it has {found.count} records of {expected.count}")
    if found.combined != expected.combined:
        raise damaged(path, "its records do not have the combined digest")
