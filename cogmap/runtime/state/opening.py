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

PROGRESS_EVERY = 100
PRAGMAS = (
    "PRAGMA locking_mode = EXCLUSIVE",
    "PRAGMA journal_mode = DELETE",
    "PRAGMA synchronous = EXTRA",
)


@contextmanager
def new_database(path: Path) -> Iterator[Path]:
    """Yield where to make a database that is to be at `path`, as `new_file` does: it has no record.

    A rollback journal that waits for it is refused, as SQLite would write that into it. Raises
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
    """Return the database at `path`, locked until it is closed, of the newest version and
    undamaged.

    A transaction that a killed process has left is rolled back first. The file is read through
    SQLite alone, as closing another descriptor of it would drop its locks. Raises StorageError.
    """
    if path.is_file() and path.stat().st_size == 0:
        raise damaged(path, "it is empty")

    uri = f"{path.absolute().as_uri()}?mode=rw"
    with named(path):
        # Each transaction is begun and ended by us.
        connection = sqlite3.connect(
            uri, uri=True, timeout=0, isolation_level=None, check_same_thread=False
        )
        try:
            for pragma in PRAGMAS:
                connection.execute(pragma)

            # Every other process is kept out, from here to the end of the connection.
            connection.execute("BEGIN EXCLUSIVE")
            _check(connection, path, progress)
            connection.execute("COMMIT")
        except UnicodeDecodeError:
            # SQLite names, in an error, a table whose name is damaged.
            connection.close()
            raise damaged(path, "its text cannot be decoded") from None
        except BaseException:
            connection.close()
            raise

    return connection


def rows(connection: sqlite3.Connection, path: Path) -> Iterator[tuple[Record, bytes]]:
    """Yield records with their digests, by sequence number. Raises StorageError at a damaged one.

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
    """Return what is kept of all records together. Raises StorageError if it is damaged."""
    match connection.execute("SELECT count, combined FROM meta").fetchall():
        case [(int(count), bytes(combined))]:
            return Totals(count, combined)

    raise damaged(path, "its number of records is missing")


def _check(connection: sqlite3.Connection, path: Path, progress: Progress) -> None:
    """Check whose it is, its version, its pages, its tables, its records. Raises StorageError."""
    ((owner,),) = connection.execute("PRAGMA application_id")
    if owner != schema.APPLICATION_ID:
        raise StorageError(
            f"{path} is a database of another program (application_id {owner}): "
            f"name another file, or move it away to start anew"
        )

    version = schema.version_of(connection)
    if not 0 <= version <= schema.version():
        raise StorageError(
            f"{path} has version {version} of the tables, and this program knows up to "
            f"{schema.version()}: install the Cogmap that wrote it, or a newer one"
        )

    ((verdict,),) = connection.execute("PRAGMA integrity_check(1)")
    if verdict != "ok":
        raise damaged(path, str(verdict))

    schema.upgrade(connection)
    if not schema.is_as_made(connection):
        raise damaged(path, "its tables are not those of its version")

    # This changes nothing; SQLite refuses it if the file is read-only, but grants the lock.
    connection.execute("UPDATE meta SET count = count WHERE false")

    expected = totals(connection, path)
    found = Totals()
    for _, digest in rows(connection, path):
        found = found.plus(digest)
        if found.count % PROGRESS_EVERY == 0:
            progress(min(1.0, found.count / max(expected.count, 1)))

    if found.count != expected.count:
        raise damaged(path, f"it has {found.count} records of {expected.count}")
    if found.combined != expected.combined:
        raise damaged(path, "its records do not have the combined digest")
