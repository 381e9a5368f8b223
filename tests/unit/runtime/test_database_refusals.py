"""Files that the database refuses, each with a sentence, and leaves as they are."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest

from cogmap.errors import StorageError
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record

RECORDS = [Record(f"key-{n}", "scene", Random(n).randbytes(10 * n * n)) for n in range(20)]
HOLDER = """
import sys
from pathlib import Path
from cogmap.runtime.state.database import Database
database = Database(Path(sys.argv[1]))
print("open", flush=True)
sys.stdin.read()
"""
WRITE_VERSION_AT = 18
CUT_EVERY_BYTES = 293
FLIP_EVERY_BYTES = 397


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A database of RECORDS."""
    path = tmp_path / "memory.db"
    database = Database(path)
    database.put(RECORDS)
    database.close()
    return path


@contextmanager
def edited(path: Path) -> Iterator[sqlite3.Connection]:
    """The database, changed behind our back."""
    connection = sqlite3.connect(path, isolation_level=None)
    yield connection
    connection.close()


def outcome(path: Path) -> list[Record] | None:
    """The records of a database; None where it is refused."""
    try:
        database = Database(path)
    except StorageError:
        return None

    records = list(database.records())
    database.close()
    return records


def refuse(path: Path, sentence: str) -> None:
    """The file must be refused with a sentence, and stay as it is."""
    before = path.read_bytes()

    with pytest.raises(StorageError, match=sentence) as refused:
        Database(path)

    assert str(path) in str(refused.value)
    assert path.read_bytes() == before


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    path.touch()

    refuse(path, r"damaged \(it is empty\): move it away to start anew")


def test_a_file_that_is_no_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    path.write_text("remember the milk\n" * 500)

    refuse(path, r"memory\.db is no SQLite database: name another")


def test_a_database_cut_short_anywhere_is_refused(path: Path) -> None:
    whole = path.read_bytes()

    for length in range(0, len(whole), CUT_EVERY_BYTES):
        path.write_bytes(whole[:length])
        assert outcome(path) is None, length


def test_a_byte_that_is_flipped_anywhere_never_changes_what_is_read(path: Path) -> None:
    whole = path.read_bytes()
    outcomes = []

    for position in range(0, len(whole), FLIP_EVERY_BYTES):
        damaged = bytearray(whole)
        damaged[position] ^= 0x41
        path.write_bytes(damaged)

        outcomes.append(outcome(path))
        assert outcomes[-1] in (None, RECORDS), position

    assert outcomes.count(None) > len(outcomes) / 3


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("UPDATE records SET kind = 'event' WHERE key = 'key-3'", "'key-3' does not have its dig"),
        ("UPDATE records SET payload = 7 WHERE key = 'key-3'", "'key-3' does not have its digest"),
        ("UPDATE records SET sequence = 99 WHERE key = 'key-3'", "'key-3' does not have its dig"),
        ("DELETE FROM records WHERE key = 'key-3'", "it has 19 records of 20"),
        ("UPDATE meta SET combined = zeroblob(16)", "do not have the combined digest"),
        ("DELETE FROM meta", "its number of records is missing"),
        ("DROP TABLE meta", "its tables are not those of its version"),
        ("CREATE TABLE more (x)", "its tables are not those of its version"),
        ("PRAGMA user_version = 0", "table records already exists"),
        ("PRAGMA user_version = 2", "version 2 of the tables, and this program knows up to 1"),
        ("PRAGMA user_version = -1", "version -1 of the tables"),
        ("PRAGMA application_id = 7", r"another program \(application_id 7\): name another file"),
    ],
)
def test_a_change_by_another_program_is_refused(path: Path, change: str, sentence: str) -> None:
    with edited(path) as connection:
        connection.execute(change)

    refuse(path, sentence)


def test_a_file_that_another_process_has_open_is_refused(path: Path) -> None:
    program = [sys.executable, "-c", HOLDER, str(path)]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "open\n"

        refuse(path, r"memory\.db is in use by another process: end that first")
        refuse(path, "in use")
        holder.communicate("")

    assert outcome(path) == RECORDS


def test_a_file_that_is_open_in_this_process_is_refused(path: Path) -> None:
    database = Database(path)

    with pytest.raises(StorageError, match="in use"):
        Database(path)
    database.put([RECORDS[0]])
    database.close()


def test_a_file_that_another_program_writes_is_refused(path: Path) -> None:
    with edited(path) as connection:
        connection.execute("BEGIN IMMEDIATE")
        refuse(path, "in use by another process")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write what is read-only")
def test_a_read_only_file_is_refused(path: Path) -> None:
    path.chmod(0o444)

    refuse(path, r"cannot write .*\(attempt to write a readonly database\)")


def test_a_file_whose_head_allows_no_writing_is_refused(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[WRITE_VERSION_AT] = 3
    path.write_bytes(content)

    refuse(path, r"cannot write .*\(attempt to write a readonly database\)")


def test_a_journal_without_its_database_is_refused(tmp_path: Path) -> None:
    journal = tmp_path / "memory.db-journal"
    journal.write_bytes(b"pages of another database")

    with pytest.raises(StorageError, match=r"memory\.db-journal belongs to a database"):
        Database(tmp_path / "memory.db")
    assert [file.name for file in tmp_path.iterdir()] == ["memory.db-journal"]


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")

    with pytest.raises(StorageError, match=r"cannot write .*state/memory\.db \(.*another folder"):
        Database(tmp_path / "state" / "memory.db")
