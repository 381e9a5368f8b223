"""The tables of the database, and the steps from one version of them to the next."""

from __future__ import annotations

import sqlite3
from contextlib import closing

APPLICATION_ID = int.from_bytes(b"CMap")
"""What SQLite keeps in the head of a file to say whose it is."""

Upgrade = tuple[str, ...]
"""The SQL statements of a step."""

UPGRADES: tuple[Upgrade, ...] = (
    (
        """CREATE TABLE records (
            key TEXT PRIMARY KEY NOT NULL,
            sequence INTEGER NOT NULL UNIQUE,
            kind TEXT NOT NULL,
            payload BLOB NOT NULL,
            digest BLOB NOT NULL
        )""",
        "CREATE TABLE meta (count INTEGER NOT NULL, combined BLOB NOT NULL)",
        "INSERT INTO meta VALUES (0, zeroblob(16))",
    ),
)
"""Step n leads from version n to version n + 1. A new database takes all of them, from 0."""


def version() -> int:
    """Return the version that all steps lead to."""
    return len(UPGRADES)


def version_of(connection: sqlite3.Connection) -> int:
    """Return the version of a database's tables."""
    ((found,),) = connection.execute("PRAGMA user_version")
    return int(found)


def upgrade(connection: sqlite3.Connection) -> None:
    """Take the steps that a database lacks, in the transaction that is open."""
    found = version_of(connection)
    for number, step in enumerate(UPGRADES[found:], start=found + 1):
        for statement in step:
            connection.execute(statement)
        connection.execute(f"PRAGMA user_version = {number}")


def is_as_made(connection: sqlite3.Connection) -> bool:
    """Return true if tables and indices are, to the letter, those that the steps make."""
    with closing(_made()) as made:
        return _objects(connection) == _objects(made)


def empty_database() -> bytes:
    """Return the file of a database without records."""
    with closing(_made()) as made:
        return made.serialize()


def _made() -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    upgrade(connection)
    return connection


def _objects(connection: sqlite3.Connection) -> set[tuple[object, ...]]:
    rows = connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema")
    return set(rows)
