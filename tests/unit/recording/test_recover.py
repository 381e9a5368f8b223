"""What is left of a log that was cut off or damaged."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from cogmap.bus.codec import Envelope, encode
from cogmap.errors import LogError
from cogmap.recording import open_log
from cogmap.recording.diff import diff
from cogmap.recording.info import info
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover
from cogmap.recording.storage.resync import LogBytes
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.testing import odometry

CHUNKS = 6
EACH = 5
ALL = range(CHUNKS * EACH)


def _message(seq: int) -> bytes:
    speed_m_s = float(np.random.default_rng(seq).normal())
    return encode(odometry(seq, speed_m_s=speed_m_s))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    writer = LogWriter(path, [topics.ODOMETRY, topics.SCAN], {"agent": "a", "began_ns": "17"})
    for seq in ALL:
        envelope = Envelope("sim", seq, 1, seq, seq)
        writer.write(topics.ODOMETRY, _message(seq), envelope, seq)
        if seq % EACH == EACH - 1:
            writer.flush()

    writer.close()
    return path


def _chunks(path: Path) -> list[tuple[int, int]]:
    chunks = []
    for span in LogBytes(path).records_from(len(MCAP0_MAGIC)):
        if span.opcode == Opcode.CHUNK:
            chunks.append((span.offset, span.end))
    return chunks


def _numbers(path: Path) -> list[int]:
    """The numbers of the messages of a log, each of which is as it was written."""
    reader = LogReader(path)
    numbers = []
    for record in reader.records():
        assert reader.payload(record) == _message(record.sequence)
        assert record.envelope is not None
        assert record.envelope.seq == record.sequence
        numbers.append(record.sequence)

    return numbers


def _altered(whole: Path, folder: Path, content: bytes) -> Path:
    path = folder / "altered.mcap"
    path.write_bytes(content)
    return path


def test_a_file_cut_at_any_byte_keeps_every_chunk_that_was_finished(
    whole: Path, tmp_path: Path
) -> None:
    content = whole.read_bytes()
    chunks = _chunks(whole)
    for cut in [
        *range(chunks[0][0], len(content) - 40, 97),
        *(end for _, end in chunks),
        len(content) - 40,
    ]:
        path = _altered(whole, tmp_path, content[:cut])
        finished = sum(end <= cut for _, end in chunks)
        assert _numbers(path) == list(range(finished * EACH))

        target = tmp_path / f"{cut}.mcap"
        recovery = recover(path, target)

        assert (recovery.messages, recovery.chunks, recovery.whole) == (
            finished * EACH,
            finished,
            False,
        )
        assert _numbers(target) == list(range(finished * EACH))


def test_the_bytes_lost_at_the_end_of_a_cut_file_are_counted(whole: Path, tmp_path: Path) -> None:
    start, end = _chunks(whole)[3]
    cut = end - 10
    path = _altered(whole, tmp_path, whole.read_bytes()[:cut])
    assert LogReader(path).cut_bytes == cut - start

    recovery = recover(path, tmp_path / "out.mcap")
    assert recovery.lost_bytes == cut - start
    assert recovery.damaged == [f"bytes {start} to {cut}: the file is cut off here"]


@pytest.mark.parametrize("number", range(CHUNKS))
def test_a_damaged_chunk_is_left_out_and_its_messages_are_counted(
    whole: Path, tmp_path: Path, number: int
) -> None:
    start, end = _chunks(whole)[number]
    content = bytearray(whole.read_bytes())
    content[end - 20] ^= 0xFF
    path = _altered(whole, tmp_path, bytes(content))
    with pytest.raises(LogError, match="cogmap log recover"):
        list(LogReader(path).records())

    recovery = recover(path, tmp_path / "out.mcap")
    assert recovery.lost_bytes == end - start
    assert recovery.messages == (CHUNKS - 1) * EACH
    assert recovery.lost_messages == EACH

    lost = range(number * EACH, (number + 1) * EACH)
    kept = [seq for seq in ALL if seq not in lost]
    assert _numbers(tmp_path / "out.mcap") == kept


@pytest.mark.parametrize("length", [0, 7, 3000, 2**50])
def test_a_record_with_a_wrong_length_costs_only_its_own_chunk(
    whole: Path, tmp_path: Path, length: int
) -> None:
    start, _ = _chunks(whole)[2]
    content = bytearray(whole.read_bytes())
    struct.pack_into("<Q", content, start + 1, length)
    path = _altered(whole, tmp_path, bytes(content))
    recover(path, tmp_path / "out.mcap")

    of_the_chunk = set(range(2 * EACH, 3 * EACH))
    recovered = set(_numbers(tmp_path / "out.mcap"))
    assert recovered >= set(ALL) - of_the_chunk


def test_a_whole_file_is_copied_as_it_is(whole: Path, tmp_path: Path) -> None:
    copy = tmp_path / "out.mcap"
    recovery = recover(whole, copy)
    about = LogReader(whole).about("recording")

    assert recovery.whole
    assert recovery.lost_bytes == 0
    assert _numbers(copy) == list(ALL)
    assert LogReader(copy).about("recording") == about


def test_random_bytes_after_the_first_record_never_break_recovery(
    whole: Path, tmp_path: Path
) -> None:
    content = whole.read_bytes()
    generator = np.random.default_rng(3)
    for trial in range(30):
        altered = bytearray(content)
        at = int(generator.integers(8, len(content) - 64))
        altered[at : at + 64] = generator.bytes(64)
        path = _altered(whole, tmp_path, bytes(altered))

        target = tmp_path / f"{trial}.mcap"
        recovery = recover(path, target)

        assert recovery.messages >= (CHUNKS - 2) * EACH
        assert len(_numbers(target)) == recovery.messages


def _read_all(path: Path) -> None:
    """Read a log in every manner there is."""
    info(path)
    list(open_log(path).messages())
    open_log(path).graph_at(1.0)
    diff(path, path)


def test_a_damaged_log_is_read_or_is_one_sentence(whole: Path, tmp_path: Path) -> None:
    content = whole.read_bytes()
    end = len(content)
    parts = [(8, 400), (end - 4000, end), (8, end)]
    generator = np.random.default_rng(4)

    refused = 0
    for trial in range(60):
        at = int(generator.integers(*parts[trial % 3]))
        altered = bytearray(content)
        altered[at] ^= int(generator.integers(1, 256))
        path = _altered(whole, tmp_path, bytes(altered))
        try:
            _read_all(path)
        except LogError as error:
            refused += 1
            assert "altered.mcap" in str(error)

    assert 0 < refused < 60


def test_a_log_whose_beginning_cannot_be_read_has_none(whole: Path, tmp_path: Path) -> None:
    content = whole.read_bytes().replace(
        b"began_ns\x02\x00\x00\x0017", b"began_ns\x02\x00\x00\x00x7"
    )

    assert info(_altered(whole, tmp_path, content)).began_ns == 0


def test_a_missing_file_and_a_foreign_one_are_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"no log .*absent.mcap"):
        LogReader(tmp_path / "absent.mcap")
    for content in (b"", b"not a log at all"):
        with pytest.raises(LogError, match=r"foreign.mcap"):
            (tmp_path / "foreign.mcap").write_bytes(content)
            LogReader(tmp_path / "foreign.mcap")
