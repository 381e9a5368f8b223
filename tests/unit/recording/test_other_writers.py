"""Logs of ours that the public MCAP library has written anew, as other tools do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from cogmap.bus.codec import Envelope, encode
from cogmap.recording.info import info
from cogmap.recording.storage.format import topics_to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.testing import odometry
from tests.support.logs import ABOUT

COUNT = 200
START_NS = 1_000_000_000
AT_ONCE = 12
TOPICS = (topics.ODOMETRY, topics.ENERGY)
KINDS: dict[str, dict[str, Any]] = {
    "plain": {},
    "unchunked": {"use_chunking": False},
    "without an index of messages": {"index_types": IndexType.CHUNK},
    "without any index": {"index_types": IndexType.NONE},
    "without a summary": {
        "index_types": IndexType.NONE,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_statistics": False,
        "use_summary_offsets": False,
    },
    "chunks of 4 KiB": {"chunk_size": 4096},
    "chunks of a message": {"chunk_size": 1},
    "zstd": {"compression": CompressionType.ZSTD},
    "uncompressed": {"compression": CompressionType.NONE},
}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Messages of two sources on each of two topics, four of them with one number. What they carry
    makes no difference here.
    """
    path = tmp_path / "log.mcap"
    writer = LogWriter(path, topics_to_record(), ABOUT)
    for seq in range(COUNT):
        for topic in TOPICS:
            for source in ("a", "b"):
                envelope = Envelope(source, seq, 1, seq, seq)
                payload = encode(odometry(seq, source=source))
                writer.write(topic, payload, envelope, START_NS)
    writer.close()
    return path


def _rewritten(log: Path, reverse: bool = False, **options: Any) -> Path:
    """The same messages and metadata, written by the library, twelve with one time."""
    path = log.with_name("rewritten.mcap")
    with log.open("rb") as source, path.open("wb") as target:
        reader = make_reader(source)
        writer = Writer(target, **options)
        writer.start("", "another tool")
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)

        channels: dict[int, int] = {}
        messages = list(reader.iter_messages(log_time_order=False))
        for schema, channel, message in reversed(messages) if reverse else messages:
            assert schema is not None
            if channel.id not in channels:
                described = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, described, channel.metadata
                )
            writer.add_message(
                channels[channel.id],
                START_NS + (message.log_time - START_NS) // AT_ONCE,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    return path


def _messages(path: Path) -> list[tuple[str, str, int, bytes]]:
    """Topic, source and number of each message by its envelope, and its bytes; sorted."""
    reader = LogReader(path)
    found = []
    for record in reader.records():
        envelope = record.envelope
        assert envelope is not None
        found.append((record.topic_name, envelope.source, envelope.seq, reader.payload(record)))
        assert reader.stub(record).source == envelope.source
    return sorted(found)


@pytest.mark.parametrize("kind", KINDS)
def test_every_message_is_read_with_its_envelope(log: Path, kind: str) -> None:
    path = _rewritten(log, **KINDS[kind])

    assert _messages(path) == _messages(log)
    found = info(path)
    assert found.messages == 4 * COUNT
    assert found.gaps == []
    assert found.cut_bytes == 0


@pytest.mark.parametrize("kind", ["plain", "unchunked", "chunks of 4 KiB"])
def test_messages_in_the_reverse_order_come_in_order_of_time(log: Path, kind: str) -> None:
    path = _rewritten(log, reverse=True, **KINDS[kind])
    times_ns = [record.log_time_ns for record in LogReader(path).records()]

    assert times_ns == sorted(times_ns)
    assert _messages(path) == _messages(log)


@pytest.mark.parametrize("kind", KINDS)
def test_recovery_saves_every_message(log: Path, kind: str) -> None:
    saved = log.with_name("saved.mcap")
    recovery = recover(_rewritten(log, **KINDS[kind]), saved)

    assert recovery.messages == 4 * COUNT
    assert _messages(saved) == _messages(log)


@pytest.mark.parametrize("kind", KINDS)
def test_a_log_that_was_cut_off_gives_what_is_whole_and_is_said_so(log: Path, kind: str) -> None:
    path = _rewritten(log, **{"chunk_size": 4096, **KINDS[kind]})
    content = path.read_bytes()
    path.write_bytes(content[: 2 * len(content) // 3])
    found = info(path)

    assert not found.finished or found.cut_bytes
    if kind != "zstd":
        assert 0 < found.messages < 4 * COUNT


@pytest.mark.parametrize("kind", ["plain", "unchunked"])
def test_zeros_after_the_end_are_no_damage(log: Path, kind: str) -> None:
    path = _rewritten(log, **KINDS[kind])
    path.write_bytes(path.read_bytes() + bytes(4096))

    assert _messages(path) == _messages(log)
    assert info(path).cut_bytes == 0


def test_a_part_of_a_log_without_chunks_is_read_alone(log: Path) -> None:
    reader = LogReader(_rewritten(log, use_chunking=False))
    begin_ns = START_NS + 10
    records = list(reader.records({topics.ODOMETRY}, start_ns=begin_ns, end_ns=begin_ns + 1))

    assert len(records) == 6
    assert {record.topic for record in records} == {topics.ODOMETRY}
    assert {record.log_time_ns for record in records} == {begin_ns}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reverse", [False, True])
def test_the_messages_of_a_topic_are_those_among_all(log: Path, kind: str, reverse: bool) -> None:
    reader = LogReader(_rewritten(log, reverse, **KINDS[kind]))
    expected = [
        (record.log_time_ns, reader.payload(record), record.envelope)
        for record in reader.records()
        if record.topic is topics.ENERGY
    ]
    alone = list(reader.records({topics.ENERGY}))

    found = [(record.log_time_ns, reader.payload(record), record.envelope) for record in alone]
    assert found == expected
    assert reader.payloads([topics.ENERGY])[topics.ENERGY] == [row[:2] for row in expected]


def test_envelopes_are_found_that_have_chunks_of_their_own(log: Path) -> None:
    """As a tool writes that puts each channel into chunks of its own."""
    path = log.with_name("sorted.mcap")
    with log.open("rb") as source, path.open("wb") as target:
        reader = make_reader(source)
        writer = Writer(target, chunk_size=2**30)
        writer.start("", "another tool")
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)

        channels: dict[int, int] = {}
        messages = sorted(reader.iter_messages(), key=lambda each: each[1].id)
        for schema, channel, message in messages:
            assert schema is not None
            if channel.id not in channels:
                writer.flush()
                described = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, described, channel.metadata
                )
            number = channels[channel.id]
            writer.add_message(
                number, message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()

    assert _messages(path) == _messages(log)
    energy = list(LogReader(path).records({topics.ENERGY}))
    assert len(energy) == 2 * COUNT
    assert None not in [record.envelope for record in energy]
