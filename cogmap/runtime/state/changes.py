"""The changes of one transaction of the database."""

from __future__ import annotations

import sqlite3

from cogmap.runtime.state.record import Record, Totals, digest_of

_INSERT = "INSERT INTO records (key, sequence, kind, payload, digest) VALUES (?, ?, ?, ?, ?)"


class Changes:
    """Puts and removes records in the transaction that is open, and keeps count of them."""

    def __init__(self, connection: sqlite3.Connection, totals: Totals) -> None:
        self._connection = connection
        self._totals = totals
        ((last,),) = connection.execute("SELECT coalesce(max(sequence), 0) FROM records")
        self._last_sequence: int = last

    def put(self, record: Record) -> None:
        """Add a record, in place of the one that has its key."""
        self.remove(record.key)
        self._last_sequence += 1
        digest = digest_of(record, self._last_sequence)

        row = (record.key, self._last_sequence, record.kind, record.payload, digest)
        self._connection.execute(_INSERT, row)
        self._totals = self._totals.plus(digest)

    def remove(self, key: str) -> None:
        """Remove the record of `key`, if there is one."""
        found = self._connection.execute("SELECT digest FROM records WHERE key = ?", (key,))
        for (digest,) in found.fetchall():
            self._connection.execute("DELETE FROM records WHERE key = ?", (key,))
            self._totals = self._totals.minus(digest)

    def finish(self) -> None:
        """Write count and combined digest, as the last change."""
        totals = (self._totals.count, self._totals.combined)
        self._connection.execute("UPDATE meta SET count = ?, combined = ?", totals)
