"""A part of a log, read without the rest of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.bus.codec import encode
from cogmap.errors import LogError
from cogmap.recording import open_log
from cogmap.recording.storage.format import topics_to_record
from cogmap.recording.storage.index import read_index
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, Phase
from cogmap.testing import odometry
from tests.support.logs import ABOUT, SECOND_NS, scan

CHUNKS = 40
IN_A_CHUNK = 5
FIRST_OFFSET = 9 + 2 + 4 + 8
"""Where an index of messages has the first message's offset: after its header, its channel, its
size and the message's time.
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A chunk a second, with five messages each; the stamp of each message is its number."""
    written = tmp_path / "log.mcap"
    writer = LogWriter(written, topics_to_record(), ABOUT)
    for number in range(CHUNKS * IN_A_CHUNK):
        at_ns = SECOND_NS + number * SECOND_NS // IN_A_CHUNK
        writer.write(topics.ODOMETRY, encode(odometry(number, stamp_ns=number)), None, at_ns)
        if number % IN_A_CHUNK == IN_A_CHUNK - 1:
            writer.flush()
    writer.close()
    return written


def damage(path: Path, chunk: int) -> None:
    """Change a byte of a chunk, which is noticed when that chunk is read."""
    begin = read_index(path).chunks[chunk].offset
    content = bytearray(path.read_bytes())
    content[begin + 100] ^= 0xFF
    path.write_bytes(content)


def numbers(path: Path, start_s: float, end_s: float) -> list[int]:
    entries = open_log(path).messages("odometry", start_s=start_s, end_s=end_s)
    return [entry.message.seq for entry in entries]


def test_a_time_is_read_to_the_message(path: Path) -> None:
    assert numbers(path, 2.0, 3.0) == [10, 11, 12, 13, 14]
    assert numbers(path, 2.3, 2.7) == [12, 13]
    assert numbers(path, 2.9, 3.1) == [15]
    assert numbers(path, 50.0, 60.0) == []


def test_records_of_a_time_are_those_among_all(path: Path) -> None:
    reader = LogReader(path)
    start_ns = 3 * SECOND_NS + 1
    end_ns = 9 * SECOND_NS
    among_all = [each for each in reader.records() if start_ns <= each.log_time_ns < end_ns]

    assert list(reader.records(start_ns=start_ns, end_ns=end_ns)) == among_all


def test_progress_counts_the_chunks_that_are_read(path: Path) -> None:
    shares: list[float] = []
    list(LogReader(path).records(None, shares.append, end_ns=5 * SECOND_NS))

    assert shares == [0.25, 0.5, 0.75, 1.0]


def test_who_reads_small_messages_unpacks_no_images_nor_deltas(tmp_path: Path) -> None:
    path = tmp_path / "kinds.mcap"
    writer = LogWriter(path, topics_to_record(), ABOUT)
    delta = Delta(version=1, cycle=1, phase=Phase.END, operations=[])
    for number in range(IN_A_CHUNK):
        at_ns = SECOND_NS + number
        writer.write(topics.STEREO, bytes(1000), None, at_ns)
        writer.write(topics.DELTA, encode(delta), None, at_ns)
        writer.write(topics.ODOMETRY, encode(odometry(number)), None, at_ns)
    writer.close()

    reader = LogReader(path)
    order = [record.topic for record in reader.records()]
    assert order == [topics.STEREO, topics.DELTA, topics.ODOMETRY] * IN_A_CHUNK

    for chunk, topic in enumerate([topics.STEREO, topics.DELTA]):
        damage(path, chunk)
        with pytest.raises(LogError, match="is damaged"):
            list(LogReader(path).records({topic}))
    assert numbers(path, 0.0, 1.0) == list(range(IN_A_CHUNK))
    assert open_log(path).frame(topics.ODOMETRY).num_rows == IN_A_CHUNK


def test_an_index_that_leads_elsewhere_is_damage(path: Path) -> None:
    indexes = read_index(path).chunks[7].indexes
    assert indexes is not None
    (where,) = indexes.values()
    content = bytearray(path.read_bytes())
    content[where + FIRST_OFFSET] ^= 0x01
    path.write_bytes(content)

    assert len(numbers(path, 0.0, 40.0)) == CHUNKS * IN_A_CHUNK
    with pytest.raises(LogError, match="is damaged"):
        open_log(path).frame(topics.ODOMETRY)


def test_a_log_that_was_cut_off_gives_the_rows_that_are_whole(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: read_index(path).chunks[30].offset])

    assert open_log(path).frame(topics.ODOMETRY).num_rows == 30 * IN_A_CHUNK


def test_a_chunk_whose_indexes_were_cut_off_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "whole.mcap"
    writer = LogWriter(path, topics_to_record(), ABOUT)
    for number in range(IN_A_CHUNK):
        writer.write(topics.ODOMETRY, encode(odometry(number)), None, SECOND_NS + 2 * number)
        writer.write(topics.SCAN, encode(scan(number)), None, SECOND_NS + 2 * number + 1)
    writer.close()
    (chunk,) = read_index(path).chunks
    content = path.read_bytes()

    cut = tmp_path / "cut.mcap"
    for more in range(0, 400, 7):
        cut.write_bytes(content[: chunk.end + more])
        for topic in (topics.ODOMETRY, topics.SCAN):
            assert len(list(LogReader(cut).records({topic}))) == IN_A_CHUNK
            assert len(LogReader(cut).payloads([topic])[topic]) == IN_A_CHUNK


def test_damage_elsewhere_is_not_met(path: Path) -> None:
    damage(path, 20)

    assert numbers(path, 2.0, 3.0) == [10, 11, 12, 13, 14]
    with pytest.raises(LogError, match="is damaged"):
        numbers(path, 0.0, 40.0)


@pytest.mark.parametrize("limit", [0, 1, 77, 100, 198, 199, 500])
def test_the_last_message_that_fits_is_found(path: Path, limit: int) -> None:
    entry = open_log(path).last("odometry", lambda message: message.stamp_ns <= limit)

    assert entry is not None
    assert entry.message.seq == min(limit, CHUNKS * IN_A_CHUNK - 1)


def test_where_none_fits_there_is_no_last(path: Path) -> None:
    assert open_log(path).last("odometry", lambda _message: False) is None
    assert open_log(path).last("motor/command", lambda _message: True) is None


def test_few_messages_are_looked_at_to_find_the_last(path: Path) -> None:
    looked_at: list[int] = []

    def is_early(message: Message) -> bool:
        looked_at.append(message.stamp_ns)
        return message.stamp_ns <= 123

    assert open_log(path).last("odometry", is_early) is not None
    assert len(looked_at) < 15
