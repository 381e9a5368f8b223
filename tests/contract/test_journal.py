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
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Decay, Delta, Link, Phase, Snapshot
from tests.support.system.disks import full_after


def delta(version: int) -> Delta:
    link = Link(source="self", target=f"place:{version}:0", weight=0.5)
    return Delta(version=version, cycle=version, phase=Phase.OBJECTS, operations=[link])


def snapshot(version: int) -> Snapshot:
    """Of an empty graph."""
    return Snapshot(version=version, cycle=version, decay=Decay(), nodes=[], links=[], tiles=[])


def opened(path: Path) -> Journal:
    """A new journal, ready to be written."""
    journal = Journal(path)
    earlier = list(journal.messages())
    assert earlier == []
    return journal


def append(journal: Journal, message: Message) -> None:
    journal.append(message, encode(message))


def written(path: Path, *messages: Message) -> list[int]:
    """Write `messages`; the size of the file after each."""
    journal = opened(path)
    sizes = []
    for message in messages:
        append(journal, message)
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
    path = tmp_path / "whole"
    torn = tmp_path / "torn"
    deltas = [delta(version) for version in range(1, 4)]
    sizes = written(path, *deltas)
    whole = path.read_bytes()

    for offset in range(len(whole) + 1):
        torn.write_bytes(whole[:offset])
        kept = [size for size in sizes if size <= offset]

        assert restored(torn) == deltas[: len(kept)]
        assert torn.stat().st_size == max(kept, default=0)


def test_a_tail_whose_bytes_never_reached_the_disk_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "j"
    deltas = [delta(version) for version in range(1, 4)]
    _, second, _ = written(path, *deltas)
    content = path.read_bytes()

    reached = content[: second + 20]
    zeros = bytes(len(content) - len(reached))
    path.write_bytes(reached + zeros)

    assert restored(path) == deltas[:2]


def test_writing_continues_behind_the_last_whole_record(tmp_path: Path) -> None:
    path = tmp_path / "j"
    written(path, delta(1), delta(2))
    content = path.read_bytes()
    path.write_bytes(content[:-1])

    journal = Journal(path)
    assert list(journal.messages()) == [delta(1)]
    append(journal, delta(2))
    journal.close()

    assert restored(path) == [delta(1), delta(2)]


def test_one_message_replaces_all_when_compacted(tmp_path: Path) -> None:
    journal = opened(tmp_path / "j")
    for version in range(1, 50):
        append(journal, delta(version))

    journal.compact(snapshot(49))
    append(journal, delta(50))
    journal.close()

    assert restored(tmp_path / "j") == [snapshot(49), delta(50)]
    assert [path.name for path in tmp_path.iterdir()] == ["j"]


def test_a_kill_during_compaction_leaves_the_old_journal(tmp_path: Path) -> None:
    written(tmp_path / "j", delta(1), delta(2))
    (tmp_path / "j.new").write_bytes(b"half of a snapsh")

    assert restored(tmp_path / "j") == [delta(1), delta(2)]

    journal = Journal(tmp_path / "j")
    journal.compact(snapshot(2))
    journal.close()
    assert restored(tmp_path / "j") == [snapshot(2)]


def test_a_whole_record_that_cannot_be_read_is_refused_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "j"
    journal = Journal(path)
    append(journal, delta(1))
    journal.append(delta(2), b"\x80")
    journal.close()
    before = path.read_bytes()

    with pytest.raises(UsageError, match=r"j: a record .* move the file away"):
        restored(path)
    assert path.read_bytes() == before


def test_a_full_disk_is_one_sentence_and_costs_only_what_was_not_written(tmp_path: Path) -> None:
    deltas = [delta(version) for version in range(1, 4)]
    _, second, _ = written(tmp_path / "whole", *deltas)
    journal = opened(tmp_path / "j")
    sentence = r"cannot write .*/j \(.*\): make room on its disk"

    with full_after(second + 20), pytest.raises(StorageError, match=sentence):
        for message in deltas:
            append(journal, message)
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

    module = Module("workspace", emits={topics.DELTA})
    module.journaling(topics.DELTA, list, Snapshot)
    shell = Shell(module, MemoryBus(network), Journal(tmp_path / "j"), health=False)
    shell.open()

    with full_after(10), pytest.raises(StorageError, match="cannot write"):
        shell.publish(module.stamp(delta(1)))

    assert published == []
    shell.close()
