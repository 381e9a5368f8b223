"""A disk that takes no more, and a folder that cannot be written to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import LogError
from cogmap.recording.recorder import Recorder, run
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover
from cogmap.recording.storage.writer import CHUNK_BYTES
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import RangeScan
from tests.support.system.disks import full_after

FULL_BYTES = 6_000_000
MESSAGE_BYTES = 200_000


def scan(seq: int) -> bytes:
    """A message that does not compress."""
    values = np.random.default_rng(seq).normal(size=MESSAGE_BYTES // 8).astype(np.float32)
    message = RangeScan(
        seq=seq,
        source="sensory",
        frame=seq,
        bearing_rad=Array.of(values),
        range_m=Array.of(values),
    )
    return encode(message)


class Disk:
    """A recorder on an in-memory bus; `stop` publishes, as the recorder asks, one message more."""

    def __init__(self, path: Path) -> None:
        self.network = MemoryNetwork()
        self.recorder = Recorder(MemoryBus(self.network), path, to_record(), {"agent": "a"})
        self._bus = MemoryBus(self.network)
        self.published = 0

    def stop(self) -> bool:
        envelope = Envelope("sensory", self.published, 1, self.published, self.published)
        self._bus.publish(topics.SCAN, scan(self.published), envelope)
        self.published += 1
        return self.published == 200


def test_a_full_disk_ends_the_recorder_with_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    disk = Disk(path)

    with (
        full_after(FULL_BYTES),
        pytest.raises(LogError, match=r"cannot write .*log\.mcap \(.*\): free some space"),
    ):
        run(disk.recorder, disk.stop)
    assert disk.published < 200
    assert Member("recorder", "recorder") not in disk.network.members


def test_what_was_flushed_before_the_disk_was_full_can_be_recovered(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    saved = tmp_path / "saved.mcap"
    disk = Disk(path)
    with full_after(FULL_BYTES), pytest.raises(LogError):
        run(disk.recorder, disk.stop)

    recovery = recover(path, saved)
    records = list(LogReader(saved).records())

    assert recovery.messages * MESSAGE_BYTES >= CHUNK_BYTES
    assert len(records) == recovery.messages


def test_a_recovery_onto_a_full_disk_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    disk = Disk(path)
    run(disk.recorder, lambda: disk.stop() or disk.published == 40)

    with full_after(FULL_BYTES), pytest.raises(LogError, match=r"saved\.mcap .*free some space"):
        recover(path, tmp_path / "saved.mcap")


def test_a_folder_that_cannot_be_written_to_is_named_with_a_remedy(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")

    for path in (tmp_path / "file" / "log.mcap", tmp_path / "file" / "deeper" / "log.mcap"):
        with pytest.raises(LogError, match="name a file in a folder that can be written to"):
            Disk(path)
