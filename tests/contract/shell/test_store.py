"""What a shell keeps between runs for a module that remembers, over either bus."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import StorageError
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record
from cogmap.runtime.state.store import Store
from cogmap.schemas import topics
from cogmap.schemas.examples import example
from cogmap.schemas.memory import Restored, Stored, StoredRecord
from cogmap.schemas.sensing import Odometry
from cogmap.testing import odometry
from tests.support.system.networks import Network, Peer, meet, publish, spin_until

STORED = example(topics.STORED)
assert isinstance(STORED, Stored)
RECORDS = STORED.records


class Run:
    """A module that stores two records once it moves, and what it was restored with."""

    def __init__(self, network: Network, path: Path, forgotten: tuple[str, ...] = ()) -> None:
        self.restored: list[Restored] = []
        self._forgotten = forgotten
        module = (
            Module("memory")
            .remembering(self.restored.append)
            .on(topics.ODOMETRY, self._store, emits=[topics.STORED])
        )
        self.shell = Shell(module, network.join(), health=False, store=Store(path))
        self.peer = Peer(network.join(), topics.STORED)
        self.peer.bus.declare(topics.ODOMETRY)
        self.shell.open()
        meet(self.peer.bus, self.shell.bus)
        spin_until(lambda: len(self.restored) == 1, self.shell)

    def store(self) -> None:
        """Have it store, and end."""
        publish(self.peer.bus, odometry(0))
        spin_until(lambda: self.peer.arrived == 1, self.shell)
        self.shell.close()

    def _store(self, moved: Odometry) -> Stored:
        return Stored(cycle=1, records=RECORDS, forgotten=list(self._forgotten))


def records(run: Run) -> list[StoredRecord]:
    """What a run began with."""
    (restored,) = run.restored
    run.shell.close()
    return restored.records


def test_the_next_run_begins_with_what_one_has_stored(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    first = Run(network, path)
    assert first.restored[0].records == []
    first.store()

    assert records(Run(network, path)) == RECORDS


def test_what_is_forgotten_is_in_no_later_run(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    Run(network, path, forgotten=(RECORDS[1].key,)).store()

    assert records(Run(network, path)) == [RECORDS[0], *RECORDS[2:]]


def test_a_record_of_another_version_is_named(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    database = Database(path)
    database.put([Record("town/objects", "objects", b"\x80")])
    database.close()
    store = Store(path)

    with pytest.raises(StorageError, match="record town/objects is of another version"):
        store.restored()
    store.close()
