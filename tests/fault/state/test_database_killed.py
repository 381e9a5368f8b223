"""The process that writes the database is killed, again and again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from benchmarks.memory.durability import has_hot_journal, kill_writers, open_damaged
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record

KILLS = 4
STORES = 20
FIRST = Record("first", "scene", b"kept")
HANGING = """
import sys
from pathlib import Path
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record

def records():
    for number in range(1000):
        yield Record(f"{number}", "scene", bytes(10_000))
    print("half written", flush=True)
    sys.stdin.read()

database = Database(Path(sys.argv[1]))
database.put([Record("first", "scene", b"kept")])
database.put(records())
"""


def test_killed_writers_lose_nothing_that_they_acknowledged(tmp_path: Path) -> None:
    killed = kill_writers(tmp_path, KILLS)

    assert killed.acknowledged >= KILLS
    assert killed.lost == 0


def test_a_kill_within_a_transaction_leaves_nothing_of_it(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    program = [sys.executable, "-c", HANGING, str(path)]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "half written\n"
        writer.kill()

    assert has_hot_journal(path)
    database = Database(path)
    assert list(database.records()) == [FIRST]
    database.put([FIRST._replace(payload=b"new")])
    database.close()
    assert [file.name for file in tmp_path.iterdir()] == ["memory.db"]


def test_a_damaged_database_never_opens_with_other_records(tmp_path: Path) -> None:
    damaged = open_damaged(tmp_path, STORES)

    assert damaged.changed == 0
    assert damaged.refused > STORES / 2
