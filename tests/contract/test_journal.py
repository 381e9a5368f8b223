"""What a journal promises across a kill."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.bus.codec import encode
from cogmap.bus.interface import Arrival
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import StorageError, UsageError
from cogmap.runtime.module import Module
from cogmap.runtime.shell import Shell
from cogmap.runtime.state.journal import Journal
from schemas import topics
from schemas.base import Message
from schemas.graph import Decay, Delta, Link, Phase, Snapshot
from tests.support.disks import full_after


def delta(version: int) -> Delta:
    operations = [Link(source="self", target=f"place:{version}:0", weight=0.5)]
    return Delta(version=version, cycle=version, phase=Phase.OBJECTS, operations=list(operations))


def written(path: Path, *messages: Message) -> list[int]:
    """Write `messages`; the size of the file after each."""
    journal = Journal(path)
    sizes = []
    assert list(journal.messages()) == []
    for message in messages:
        journal.append(message, encode(message))
        sizes.append(path.stat().st_size)
    journal.close()
    return sizes


def restored(path: Path) -> list[Message]:
    journal = Journal(path)
    messages = list(journal.messages())
    journal.close()
    return messages


def test_what_was_written_is_read_in_order(tmp_path: Path) -> None:
    deltas = [delta(version) for version in range(1, 6)]
    written(tmp_path / "j", *deltas)

    assert restored(tmp_path / "j") == deltas


def test_a_tail_torn_at_any_byte_costs_only_the_record_it_is_in(tmp_path: Path) -> None:
    deltas = [delta(version) for version in range(1, 4)]
    sizes = written(tmp_path / "whole", *deltas)
    whole = (tmp_path / "whole").read_bytes()

    for offset in range(len(whole) + 1):
        torn = tmp_path / "torn"
        torn.write_bytes(whole[:offset])
        complete = sum(size <= offset for size in sizes)
        assert restored(torn) == deltas[:complete]
        assert torn.stat().st_size == ([0, *sizes])[complete]


def test_a_tail_whose_bytes_never_reached_the_disk_is_cut_off(tmp_path: Path) -> None:
    deltas = [delta(version) for version in range(1, 4)]
    sizes = written(tmp_path / "j", *deltas)
    content = (tmp_path / "j").read_bytes()

    (tmp_path / "j").write_bytes(content[: sizes[1] + 20] + bytes(sizes[2] - sizes[1] - 20))

    assert restored(tmp_path / "j") == deltas[:2]


def test_writing_continues_behind_the_last_whole_record(tmp_path: Path) -> None:
    sizes = written(tmp_path / "j", delta(1), delta(2))
    content = (tmp_path / "j").read_bytes()
    (tmp_path / "j").write_bytes(content[: sizes[1] - 1])

    journal = Journal(tmp_path / "j")
    assert list(journal.messages()) == [delta(1)]
    journal.append(delta(2), encode(delta(2)))
    journal.close()

    assert restored(tmp_path / "j") == [delta(1), delta(2)]


def test_one_message_replaces_all_when_compacted(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "j")
    assert list(journal.messages()) == []
    for version in range(1, 50):
        journal.append(delta(version), encode(delta(version)))
    snapshot = Snapshot(version=49, cycle=49, decay=Decay(), nodes=[], links=[], tiles=[])

    journal.compact(snapshot)
    journal.append(delta(50), encode(delta(50)))
    journal.close()

    assert restored(tmp_path / "j") == [snapshot, delta(50)]
    assert [path.name for path in tmp_path.iterdir()] == ["j"]


def test_a_kill_during_compaction_leaves_the_old_journal(tmp_path: Path) -> None:
    written(tmp_path / "j", delta(1), delta(2))
    (tmp_path / "j.new").write_bytes(b"half of a snapsh")

    assert restored(tmp_path / "j") == [delta(1), delta(2)]

    journal = Journal(tmp_path / "j")
    snapshot = Snapshot(version=2, cycle=2, decay=Decay(), nodes=[], links=[], tiles=[])
    journal.compact(snapshot)
    journal.close()
    assert restored(tmp_path / "j") == [snapshot]


def test_a_whole_record_that_cannot_be_read_is_refused_and_kept(tmp_path: Path) -> None:
    stranger = Delta(version=2, cycle=2, phase=Phase.OBJECTS, operations=[])
    journal = Journal(tmp_path / "j")
    journal.append(delta(1), encode(delta(1)))
    journal.append(stranger, b"\x80")
    journal.close()
    size = (tmp_path / "j").stat().st_size

    with pytest.raises(UsageError, match=r"j: a record .* move the file away"):
        restored(tmp_path / "j")
    assert (tmp_path / "j").stat().st_size == size


def test_a_full_disk_is_one_sentence_and_costs_only_what_was_not_written(tmp_path: Path) -> None:
    sizes = written(tmp_path / "whole", *(delta(version) for version in range(1, 4)))
    journal = Journal(tmp_path / "j")
    assert list(journal.messages()) == []

    with (
        full_after(sizes[1] + 20),
        pytest.raises(StorageError, match=r"cannot write .*/j \(.*\): make room on its disk"),
    ):
        for version in range(1, 4):
            journal.append(delta(version), encode(delta(version)))
    journal.close()

    assert restored(tmp_path / "j") == [delta(1), delta(2)]


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")

    with pytest.raises(StorageError, match=r"cannot write .*/j \(.*\): name another folder"):
        Journal(tmp_path / "state" / "j")


def test_a_module_whose_journal_cannot_be_written_publishes_nothing_of_it(tmp_path: Path) -> None:
    network = MemoryNetwork()
    published: list[Arrival] = []
    MemoryBus(network).subscribe(topics.DELTA, published.append, lambda topic, number: None)
    module = Module("workspace", emits={topics.DELTA}).journaling(topics.DELTA, list, Snapshot)
    journal = Journal(tmp_path / "j")
    shell = Shell(module, MemoryBus(network), journal, health=False)
    shell.open()

    with full_after(10), pytest.raises(StorageError, match="cannot write"):
        shell.publish(module.stamp(delta(1)))

    assert published == []
    shell.close()
