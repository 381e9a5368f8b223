"""Records that the database loses to kills of its writer, and to damage of its file."""

from __future__ import annotations

import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from random import Random
from typing import NamedTuple

from benchmarks.memory.writer import record_of
from cogmap.cli.progress import bar
from cogmap.errors import StorageError
from cogmap.runtime.state.database import Database, write_new
from cogmap.runtime.state.record import digest_of

SEED = 11
MAX_TRANSACTIONS = 20
MAX_DELAY_S = 0.1
STORED = 300
REMOVED = range(50, 80)
MAX_FLIPS = 8
_REPOSITORY = Path(__file__).parents[2]


class Killed(NamedTuple):
    """The records acknowledged before kills, and of these lost; and the kills that left a
    transaction that is rolled back.
    """

    acknowledged: int
    lost: int
    rolled_back: int


class Damaged(NamedTuple):
    """The damaged copies that opened with other records, opened with the same, and were refused."""

    changed: int
    same: int
    refused: int


def kill_writers(folder: Path, kills: int) -> Killed:
    """Kill a writer `kills` times, and look for what it acknowledged after each.

    Each kill comes after a random number of transactions and a random delay. Raises StorageError
    if the database does not open.
    """
    path = folder / "killed.db"
    random = Random(SEED)
    acknowledged: dict[str, bytes] = {}
    lost: set[str] = set()
    rolled_back = 0

    with bar("killing writers") as progress:
        for kill in range(kills):
            for number in _written_until_killed(path, len(acknowledged), random):
                record = record_of(number)
                acknowledged[record.key] = digest_of(record, sequence=0)

            rolled_back += has_hot_journal(path)

            # Missing, or not as acknowledged.
            missing = set(acknowledged)
            with closing(Database(path)) as database:
                for record in database.records():
                    if acknowledged.get(record.key) == digest_of(record, sequence=0):
                        missing.remove(record.key)

            lost |= missing
            progress((kill + 1) / kills)

    return Killed(len(acknowledged), len(lost), rolled_back)


def open_damaged(folder: Path, stores: int) -> Damaged:
    """Open `stores` copies of a database: of one half bytes are flipped, the other half is cut."""
    path = folder / "whole.db"
    write_new(path, map(record_of, range(STORED)))
    # With some records removed, the file has unused pages.
    with closing(Database(path)) as database:
        database.remove([record_of(number).key for number in REMOVED])
        stored = list(database.records())

    whole = path.read_bytes()
    random = Random(SEED)
    changed = 0
    same = 0
    refused = 0
    with bar("opening damaged databases") as progress:
        for store in range(stores):
            copy = folder / f"damaged-{store}.db"
            damaged = bytearray(whole)
            if store % 2:
                for _ in range(random.randint(1, MAX_FLIPS)):
                    damaged[random.randrange(len(whole))] ^= random.randint(1, 255)
            else:
                del damaged[random.randrange(len(whole)) :]

            copy.write_bytes(damaged)
            try:
                with closing(Database(copy)) as database:
                    is_same = list(database.records()) == stored
                same += is_same
                changed += not is_same
            except StorageError:
                refused += 1

            copy.unlink()
            progress((store + 1) / stores)

    return Damaged(changed, same, refused)


def has_hot_journal(path: Path) -> bool:
    """Decide whether pages of an unfinished transaction may be in the database at `path`.

    They may be if its journal's head does not begin with zero (sqlite.org/fileformat2, section 3).
    """
    journal = path.with_name(f"{path.name}-journal")
    if not journal.exists():
        return False

    with journal.open("rb") as file:
        return file.read(1) not in (b"", b"\0")


def _written_until_killed(path: Path, first: int, random: Random) -> list[int]:
    """Kill a writer at a random moment; return the numbers acknowledged, those in its pipe too."""
    program = [sys.executable, "-m", "benchmarks.memory.writer", str(path.absolute()), str(first)]
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True, cwd=_REPOSITORY) as writer:
        assert writer.stdout is not None
        transactions = random.randint(1, MAX_TRANSACTIONS)
        lines = [writer.stdout.readline() for _ in range(transactions)]
        time.sleep(random.uniform(0.0, MAX_DELAY_S))

        writer.kill()
        lines += writer.stdout.readlines()

    # The kill may have cut the last line short.
    whole = [line for line in lines if line.endswith("\n")]
    return [int(word) for line in whole for word in line.split()]
