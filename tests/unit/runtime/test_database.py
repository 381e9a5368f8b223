"""What the database keeps, in which order, and across what."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from cogmap.errors import StorageError
from cogmap.runtime.state import schema
from cogmap.runtime.state.database import Database, write_new
from cogmap.runtime.state.record import Record
from tests.support.system.disks import full_after

A = Record("a", "scene", b"first")
B = Record("b", "event", b"")
C = Record("c", "scene", bytes(range(256)))
LARGE = Record("large", "scene", bytes(4_000_000))
MANY = [Record(f"key-{n}", "scene", bytes(5000)) for n in range(500)]
FULL_BYTES = 100_000


def put(path: Path, *records: Record) -> None:
    database = Database(path)
    database.put(records)
    database.close()


def kept(path: Path) -> list[Record]:
    database = Database(path)
    records = list(database.records())
    database.close()
    return records


def broken_off() -> Iterator[Record]:
    """A record, and then a failure of who makes them."""
    yield C
    raise ValueError("no more")


def test_records_come_in_the_order_in_which_they_were_put(tmp_path: Path) -> None:
    path = tmp_path / "state" / "memory.db"

    put(path, C, A)
    put(path, B)

    assert kept(path) == [C, A, B]


def test_a_record_takes_the_place_of_its_key_and_is_the_newest(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    newer = Record("a", "event", b"second")

    put(path, A, B)
    put(path, newer)

    assert kept(path) == [B, newer]


def test_a_removed_record_is_gone_and_an_absent_key_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    put(path, A, B, C)

    database = Database(path)
    database.remove(["b", "absent"])
    database.close()

    assert kept(path) == [A, C]


def test_a_database_is_empty_until_a_record_is_put(tmp_path: Path) -> None:
    database = Database(tmp_path / "memory.db")
    assert database.is_empty

    database.put([A, B])
    assert not database.is_empty
    assert database.count == 2
    database.close()


def test_a_transaction_whose_records_break_off_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    put(path, A)
    database = Database(path)

    with pytest.raises(ValueError, match="no more"):
        database.put(broken_off())
    database.put([B])
    database.close()

    assert kept(path) == [A, B]


def test_a_transaction_that_a_kill_cut_off_is_rolled_back(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    killed = tmp_path / "killed.db"
    put(path, *MANY)
    whole = path.read_bytes()

    def replaced() -> Iterator[Record]:
        """More than SQLite's cache holds; then the files, as a kill would leave them."""
        for record in MANY:
            yield record._replace(payload=b"newer")
        yield LARGE
        shutil.copy(path, killed)
        shutil.copy(f"{path}-journal", f"{killed}-journal")

    database = Database(path)
    database.put(replaced())
    database.close()

    assert killed.read_bytes()[: len(whole)] != whole
    assert kept(killed) == MANY


def test_opening_a_database_writes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    put(path, A, B)
    before = (path.stat().st_mtime_ns, path.read_bytes())

    kept(path)

    assert (path.stat().st_mtime_ns, path.read_bytes()) == before
    assert [file.name for file in tmp_path.iterdir()] == ["memory.db"]


def test_a_full_disk_is_one_sentence_and_costs_nothing_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    put(path, A)
    database = Database(path)

    with full_after(FULL_BYTES), pytest.raises(StorageError, match=r"cannot write .*: make room"):
        database.put([B, LARGE])
    database.put([C])
    database.close()

    assert kept(path) == [A, C]


def test_a_journal_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    database = Database(path)
    (tmp_path / "memory.db-journal").mkdir()

    with pytest.raises(StorageError, match=r"cannot write .*memory\.db \(unable to open"):
        database.put([A])
    assert database.is_empty
    database.close()


def test_a_database_of_an_older_version_is_upgraded_and_keeps_its_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "memory.db"
    put(path, A, B)
    steps = (*schema.UPGRADES, ("CREATE INDEX by_kind ON records (kind)",))
    monkeypatch.setattr(schema, "UPGRADES", steps)

    put(path, C)

    assert kept(path) == [A, B, C]
    ((version,),) = sqlite3.connect(path).execute("PRAGMA user_version")
    assert version == 2


def test_an_upgrade_that_fails_leaves_the_older_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "memory.db"
    put(path, A)
    steps = (*schema.UPGRADES, ("DELETE FROM records", "DELETE FROM absent"))

    with monkeypatch.context() as later:
        later.setattr(schema, "UPGRADES", steps)
        with pytest.raises(StorageError, match=r"damaged \(no such table: absent\)"):
            Database(path)

    assert kept(path) == [A]


def test_a_new_database_of_records_that_break_off_is_not_made(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no more"):
        write_new(tmp_path / "memory.db", broken_off())

    assert list(tmp_path.iterdir()) == []


def test_a_new_database_takes_the_place_of_no_file(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    put(path, A)

    with pytest.raises(StorageError, match=r"memory\.db exists already: move it away"):
        write_new(path, [B])
    assert kept(path) == [A]
