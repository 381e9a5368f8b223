"""Recording on the in-memory bus: what the file holds afterwards."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from mcap.writer import CompressionType

from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Member
from cogmap.bus.memory import MemoryBus, MemoryNetwork
from cogmap.errors import LogError
from cogmap.recording.copying import Part, copy
from cogmap.recording.info import info
from cogmap.recording.recorder import WHOLE, Recorder, Split, Summary
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.testing import odometry
from tests.support.logs import scan


class Recorded:
    """A network with a recorder on it, and a bus to publish on."""

    def __init__(
        self,
        path: Path,
        limit_bytes: int = 2**20,
        split: Split = WHOLE,
        snapshot_s: float | None = None,
    ) -> None:
        self.network = MemoryNetwork()
        self.bus = MemoryBus(self.network)
        about = {"agent": "a", "config": "{}"}
        self.recorder = Recorder(
            MemoryBus(self.network),
            path,
            to_record(),
            about,
            limit_bytes=limit_bytes,
            split=split,
            snapshot_s=snapshot_s,
        )
        self.recorder.open()

    def publish(self, message: Message, at_ns: int, incarnation: int = 1) -> bytes:
        payload = encode(message)
        envelope = Envelope(message.source, message.seq, incarnation, at_ns, at_ns)
        self.publish_bytes(topics.of(message), payload, envelope)
        return payload

    def publish_bytes(self, topic: topics.Topic, payload: bytes, envelope: Envelope) -> None:
        self.bus.publish(topic, payload, envelope)

    def pump_all(self) -> None:
        while self.recorder.pump():
            pass

    def end(self) -> Summary:
        return self.recorder.close()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "log.mcap"


def test_a_log_gives_back_bytes_times_and_envelopes_in_order_of_arrival(path: Path) -> None:
    recorded = Recorded(path)
    payloads = []
    for at_ns, message in enumerate((odometry(0), scan(0), odometry(1), scan(1)), start=100):
        payloads.append(recorded.publish(message, at_ns))

    last = encode(odometry(2))
    envelope = Envelope("sim", 2, 1, 105, 90, [("sim", 3, 4)], [("motor/command", "action", 7)])
    recorded.publish_bytes(topics.ODOMETRY, last, envelope)
    recorded.end()

    reader = LogReader(path)
    records = list(reader.records())
    assert [reader.payload(record) for record in records] == [*payloads, last]
    assert [record.log_time_ns for record in records] == [100, 101, 102, 103, 105]
    assert [record.sequence for record in records] == [0, 0, 1, 1, 2]
    assert records[-1].envelope == envelope
    assert reader.about("recording")["agent"] == "a"


def test_a_summary_counts_messages_by_topic_and_that_none_is_missing(
    path: Path,
) -> None:
    recorded = Recorded(path)
    recorded.publish(odometry(0), 1)
    recorded.publish(scan(0), 2)
    summary = recorded.end()

    assert summary.messages == {"odometry": 1, "sensory/scan": 1}
    assert summary.never_drop_whole
    assert summary.gaps == []
    assert summary.rejected == {}
    assert summary.size_bytes == path.stat().st_size


def test_a_gap_is_named_with_its_source_and_its_numbers(path: Path) -> None:
    recorded = Recorded(path)
    for seq in (0, 1, 4, 5, 7):
        recorded.publish(odometry(seq), seq)
    summary = recorded.end()

    assert summary.lost == {"odometry": 3}
    assert summary.gaps == ["odometry (never drop): 3 of sim missing, number 2 to 3, 6"]
    assert not summary.never_drop_whole


def test_a_gap_in_a_latest_wins_topic_leaves_never_drop_topics_whole(
    path: Path,
) -> None:
    recorded = Recorded(path)
    recorded.publish(scan(0), 0)
    recorded.publish(scan(3), 1)
    summary = recorded.end()

    assert summary.gaps == ["sensory/scan (latest wins): 2 of sensory missing, number 1 to 2"]
    assert summary.never_drop_whole


def test_a_source_begun_after_the_recorder_is_awaited_from_number_0(
    path: Path,
) -> None:
    recorded = Recorded(path)
    recorded.publish(odometry(5), 1, incarnation=1)
    recorded.publish(odometry(2, source="later"), 2, incarnation=2**62)
    summary = recorded.end()

    assert summary.gaps == ["odometry (never drop): 2 of later missing, number 0 to 1"]


def test_a_restarted_source_begins_anew_and_that_is_no_gap(path: Path) -> None:
    recorded = Recorded(path)
    for incarnation in (1, 2):
        for seq in (0, 1):
            recorded.publish(odometry(seq), seq, incarnation)

    assert recorded.end().gaps == []


def _restarted(path: Path, ended_at: int) -> Recorded:
    """A recording of two messages of a source, its restart, and one more; the new incarnation
    states that the old one published so many in all.
    """
    recorded = Recorded(path)
    published = (
        Envelope("sim", 0, 1, 0, 0, earlier=10),
        Envelope("sim", 1, 1, 1, 1, earlier=10),
        Envelope("sim", 0, 2, 0, 0, earlier=ended_at),
    )
    for envelope in published:
        message = encode(odometry(envelope.seq))
        recorded.publish_bytes(topics.ODOMETRY, message, envelope)

    return recorded


def test_what_a_source_published_before_its_restart_and_is_missing_is_a_gap(path: Path) -> None:
    recorded = _restarted(path, ended_at=15)
    summary = recorded.end()

    assert summary.gaps == ["odometry (never drop): 3 of sim missing, number 2 to 4"]
    assert summary.lost == {"odometry": 3}


def test_a_restart_after_which_nothing_is_missing_is_no_gap(path: Path) -> None:
    recorded = _restarted(path, ended_at=12)

    assert recorded.end().gaps == []


def test_what_is_no_message_is_counted_and_not_written(path: Path) -> None:
    recorded = Recorded(path)
    recorded.publish(odometry(0), 1)
    recorded.publish_bytes(topics.ODOMETRY, b"\xc1", Envelope("sim", 1, 1, 2, 2))
    of_another = Envelope("mallory", 1, 1, 3, 3)
    recorded.publish_bytes(topics.ODOMETRY, encode(odometry(1)), of_another)

    summary = recorded.end()

    records = list(LogReader(path).records())
    assert summary.rejected == {"odometry": 2}
    assert len(records) == 1


def test_numbers_that_mcap_has_no_room_for_are_kept_in_the_envelope(path: Path) -> None:
    seq = 2**40 + 3
    far = msgspec.structs.replace(scan(0), seq=seq)
    recorded = Recorded(path)
    recorded.publish_bytes(topics.SCAN, encode(far), Envelope("sensory", seq, 1, -5, -5))
    recorded.end()

    (record,) = LogReader(path).records()
    assert (record.sequence, record.publish_ns, record.log_time_ns) == (3, 0, 0)
    assert record.envelope is not None
    assert record.envelope.seq == seq
    assert record.envelope.sent_ns == -5


def test_what_finds_no_room_is_counted_and_never_drop_topics_have_more(
    path: Path,
) -> None:
    recorded = Recorded(path, limit_bytes=40_000)
    for seq in range(50):
        recorded.publish(scan(seq), seq)
    for seq in range(5):
        recorded.publish(odometry(seq), seq)
    summary = recorded.end()

    assert summary.messages["odometry"] == 5
    assert 0 < summary.messages["sensory/scan"] < 50
    assert summary.dropped == {"sensory/scan": 50 - summary.messages["sensory/scan"]}
    assert summary.never_drop_whole


def test_latest_wins_messages_are_all_recorded_by_a_late_recorder(
    path: Path,
) -> None:
    recorded = Recorded(path)
    for seq in range(20):
        recorded.publish(scan(seq), seq)

    assert recorded.end().messages == {"sensory/scan": 20}


def test_others_can_wait_for_the_recorder_and_it_notes_who_is_there(path: Path) -> None:
    recorded = Recorded(path)
    assert Member("recorder", "recorder") in recorded.network.members

    recorded.bus.announce(Member("codelets", "codelets-1"))
    recorded.end()

    members = []
    for name, facts in LogReader(path).metadata:
        if name == "member":
            members.append(facts["instance"])
    assert members[:2] == ["recorder", "codelets-1"]


def test_an_existing_file_is_never_overwritten(path: Path) -> None:
    path.write_text("precious")

    with pytest.raises(LogError, match="exists already"):
        Recorded(path)
    assert path.read_text() == "precious"


@pytest.mark.parametrize("compression", CompressionType)
def test_a_log_is_read_however_it_is_compressed(path: Path, compression: CompressionType) -> None:
    recorder = Recorder(MemoryBus(MemoryNetwork()), path, to_record(), {}, compression=compression)
    recorder.open()
    recorder.close()

    assert LogReader(path).about("summary")


def test_a_recording_is_split_into_files_of_which_merge_makes_one(path: Path) -> None:
    recorded = Recorded(path, split=Split(max_s=1e-9))
    for number in range(3):
        recorded.publish(odometry(number), 1 + number)
        assert recorded.recorder.pump()
        recorded.recorder.flush()
    summary = recorded.end()

    parts = [Path(part) for part in summary.paths]
    assert len(parts) >= 4
    assert [part.name for part in parts[:3]] == ["log.mcap", "log-2.mcap", "log-3.mcap"]
    assert summary.messages == {"odometry": 3}
    assert summary.size_bytes == sum(part.stat().st_size for part in parts)
    assert all(info(part).finished for part in parts)

    whole = path.with_name("whole.mcap")
    copied = copy(sorted(parts), whole, Part(topics=to_record()))
    assert copied.messages == {"odometry": 3}
    assert not info(whole).gaps


def test_of_a_split_recording_the_newest_files_are_kept_and_no_more(path: Path) -> None:
    recorded = Recorded(path, split=Split(max_s=1e-9, keep=2))
    for _ in range(5):
        recorded.recorder.flush()
    summary = recorded.end()

    parts = sorted(part.name for part in path.parent.glob("*.mcap"))
    assert parts == ["log-4.mcap", "log-5.mcap", "log-6.mcap"]
    assert [Path(part).name for part in summary.paths] == parts
    assert summary.size_bytes == sum(Path(part).stat().st_size for part in summary.paths)


def test_a_file_that_is_large_enough_is_the_last_but_one(path: Path) -> None:
    empty = path.with_name("empty.mcap")
    Recorded(empty)
    recorded = Recorded(path, split=Split(max_bytes=empty.stat().st_size + 500))
    recorded.recorder.flush()
    assert not path.with_name("log-2.mcap").exists()

    for number in range(100):
        recorded.publish(odometry(number), 1 + number)
        recorded.recorder.pump()
    recorded.recorder.flush()

    assert path.with_name("log-2.mcap").exists()


def test_messages_that_come_during_a_pause_are_left_out_and_counted(path: Path) -> None:
    recorded = Recorded(path)
    for number, is_paused in enumerate((False, True, True, False)):
        recorded.recorder.is_paused = is_paused
        recorded.publish(odometry(number), 1 + number)
        recorded.pump_all()
    summary = recorded.end()

    assert [record.sequence for record in LogReader(path).records()] == [0, 3]
    assert summary.messages == {"odometry": 2}
    assert summary.left_out == {"odometry": 2}
    assert summary.lost == {}


def recorded_seconds(recorded: Recorded, seconds: range) -> None:
    """Publish and receive a message in each of those seconds."""
    for second in seconds:
        recorded.publish(odometry(second), second * 10**9)
        recorded.pump_all()


def test_a_snapshot_has_the_last_seconds_and_the_next_one_what_came_after(path: Path) -> None:
    recorded = Recorded(path, snapshot_s=3.0)
    recorded_seconds(recorded, range(10))
    assert not path.exists()

    first = recorded.recorder.snapshot()
    recorded_seconds(recorded, range(10, 12))
    second = recorded.recorder.snapshot()
    summary = recorded.end()

    assert (first, second) == (path, path.with_name("log-2.mcap"))
    assert [record.sequence for record in LogReader(first).records()] == [6, 7, 8, 9]
    assert [record.sequence for record in LogReader(second).records()] == [10, 11]
    assert summary.paths == [str(first), str(second)]
    assert summary.messages == {"odometry": 6}
    assert summary.left_out == {"odometry": 6}
    assert info(first).finished


def test_a_snapshot_keeps_the_newest_messages_that_memory_has_room_for(path: Path) -> None:
    recorded = Recorded(path, limit_bytes=8000, snapshot_s=1e6)
    recorded_seconds(recorded, range(100))
    snapshot = recorded.recorder.snapshot()

    numbers = [record.sequence for record in LogReader(snapshot).records()]
    assert 2 <= len(numbers) < 10
    assert numbers == list(range(100 - len(numbers), 100))


def test_without_a_snapshot_there_is_no_file(path: Path) -> None:
    recorded = Recorded(path, snapshot_s=3.0)
    recorded_seconds(recorded, range(3))
    summary = recorded.end()

    assert summary.paths == []
    assert list(path.parent.iterdir()) == []


def test_a_snapshot_never_overwrites_a_file(path: Path) -> None:
    path.write_text("precious")

    with pytest.raises(LogError, match="exists already"):
        Recorded(path, snapshot_s=3.0)
