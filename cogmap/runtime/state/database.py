"""What a module remembers for good, in a file of its own that no kill and no fault changes unseen.

The file is an SQLite database, changed through SQLite's rollback journal (sqlite.org/atomiccommit).
A write-ahead log would be faster, but one that is cut short loses transactions without a word.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from cogmap.runtime.state.changes import Changes
from cogmap.runtime.state.failures import named
from cogmap.runtime.state.opening import Progress, new_database, opened, rows, totals
from cogmap.runtime.state.record import Record


class Database:
    """Records by their keys, in the order in which they were put.

    Opening the file at `path` makes it where there is none, rolls back what a killed process left
    unfinished, and reads all of it; `progress` is called with the share that is checked. A file
    that is not as it was written is refused, and so is one that another process has open: nothing
    is ever put in its place. It is used by one thread at a time. Every method raises StorageError
    where the file is damaged, or the disk refuses.
    """

    def __init__(self, path: Path, progress: Progress = lambda share: None) -> None:
        if not path.exists():
            write_new(path, ())
        self._path = path
        self._connection = opened(path, progress)

    def put(self, records: Iterable[Record]) -> None:
        """Add `records` in one transaction, each in place of the one that has its key.

        All are on the disk on return, and none if this raises or the process is killed: SQLite
        writes the pages as they were to the journal and syncs it, then the journal's head, then the
        pages to the database, and then zeros over the journal's head, which is the commit; it calls
        fdatasync after each of the four, and more often if they exceed its cache of 2 MB. The first
        transaction also syncs the folder, in which the journal is new. What the disk reports as
        synced must be so. synchronous=EXTRA adds that the folder is synced when a journal in it is
        deleted, at the end.
        """
        with self._transaction() as changes:
            for record in records:
                changes.put(record)

    def remove(self, keys: Iterable[str]) -> None:
        """Remove the records of `keys`, if there are any, as durably as they are put."""
        with self._transaction() as changes:
            for key in keys:
                changes.remove(key)

    def records(self) -> Iterator[Record]:
        """Yield every record, by the time it was put. Nothing may be put or removed meanwhile."""
        with named(self._path):
            for record, _ in rows(self._connection, self._path):
                yield record

    @property
    def count(self) -> int:
        """Return how many records it has."""
        with named(self._path):
            return totals(self._connection, self._path).count

    @property
    def is_empty(self) -> bool:
        """Return whether it has no record."""
        return self.count == 0

    def close(self) -> None:
        """Close the file, and let other processes open it."""
        self._connection.close()

    @contextmanager
    def _transaction(self) -> Iterator[Changes]:
        """Yield changes that are on the disk when the block ends, and are undone if it raises."""
        connection = self._connection
        with named(self._path):
            connection.execute("BEGIN IMMEDIATE")
            try:
                changes = Changes(connection, totals(connection, self._path))
                yield changes
                changes.finish()
                connection.execute("COMMIT")
            except BaseException:
                # SQLite itself rolls back if the disk is full. If the disk refuses that too, SQLite
                # refuses all that follows, and opening the file anew rolls back.
                if connection.in_transaction:
                    with suppress(sqlite3.OperationalError):
                        connection.execute("ROLLBACK")
                raise


def write_new(path: Path, records: Iterable[Record]) -> None:
    """Make a database of `records` at `path`, which is there once it has all of them.

    If `records` raises, nothing is there. Raises StorageError if there is a file already.
    """
    with new_database(path) as made, closing(Database(made)) as database:
        database.put(records)
