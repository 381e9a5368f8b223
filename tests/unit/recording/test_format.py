"""What other programs find in a log, and which logs are read."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import Schema
from mcap.writer import Writer

from cogmap.bus.codec import Envelope, encode
from cogmap.errors import LogError
from cogmap.recording.storage import versions
from cogmap.recording.storage.format import topics_to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.recover import recover
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.testing import odometry
from cogmap.version import VERSION
from tests.support.mcap_doctor import Doctor


def write(path: Path, times_ns: list[int], flush_every: int = 2) -> None:
    """A log of odometry received at `times_ns`, in several chunks."""
    writer = LogWriter(path, topics_to_record(), {"agent": "a"})
    for seq, time_ns in enumerate(times_ns):
        envelope = Envelope("sim", seq, 1, time_ns, time_ns)
        writer.write(topics.ODOMETRY, encode(odometry(seq)), envelope, time_ns)
        if seq % flush_every == flush_every - 1:
            writer.flush()

    writer.close()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "log.mcap"


@contextmanager
def raw(path: Path, library: str) -> Iterator[Writer]:
    """An MCAP file by the library alone, as `library` would have written it."""
    with path.open("xb") as file:
        writer = Writer(file)
        writer.start("", library)
        yield writer
        writer.finish()


def test_mcap_doctor_has_nothing_to_warn_of(path: Path) -> None:
    write(path, [5, 6, 6, 7, 9])

    assert Doctor().examine(path) == []


def test_mcap_doctor_has_nothing_to_warn_of_in_a_recovered_log(path: Path, tmp_path: Path) -> None:
    write(path, [5, 6, 6, 7, 9])
    cut = tmp_path / "cut.mcap"
    saved = tmp_path / "saved.mcap"
    cut.write_bytes(path.read_bytes()[:-3000])
    recover(cut, saved)

    assert Doctor().examine(saved) == []


def test_log_times_go_on_where_the_clock_is_set_back(path: Path) -> None:
    write(path, [50, 60, 20, 30, 70])
    records = list(LogReader(path).records())
    log_times_ns = [record.log_time_ns for record in records]
    numbers = [record.sequence for record in records]

    assert log_times_ns == [50, 60, 61, 62, 70]
    assert numbers == [0, 1, 2, 3, 4]
    assert records[2].envelope is not None
    assert records[2].envelope.sent_ns == 20
    assert Doctor().examine(path) == []


def test_every_channel_names_its_message_type_and_encoding(path: Path) -> None:
    write(path, [1])
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None

    named = {}
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (channel.message_encoding, schema.encoding) == ("msgpack", "jsonschema")
        named[channel.topic] = schema.name

    assert named.pop("_envelope") == "EnvelopeRecord"
    assert named == {topic.name: topic.type.__name__ for topic in topics_to_record()}


def test_the_schema_of_a_channel_describes_its_message_fields(path: Path) -> None:
    write(path, [1])
    with path.open("rb") as file:
        ((schema, _, _),) = make_reader(file).iter_messages(topics=["odometry"])
    assert isinstance(schema, Schema)

    fields = json.loads(schema.data)["$defs"]["Odometry"]["properties"]
    assert {"speed_m_s", "turn_rate_rad_s", "stamp_ns"} <= fields.keys()


def test_a_log_names_the_version_that_wrote_it(path: Path) -> None:
    write(path, [1])
    with path.open("rb") as file:
        header = make_reader(file).get_header()

    software = LogReader(path).about("recording")["software"]
    assert header.library == f"cogmap {VERSION}"
    assert software == f"cogmap {VERSION}"


@pytest.mark.parametrize("software", ["cogmap 0.0.9", "cogmap 9.1.0"])
def test_a_log_of_another_version_is_refused_with_the_one_that_reads_it(
    path: Path, software: str
) -> None:
    with raw(path, software) as writer:
        writer.add_metadata("recording", {"software": software})
    version = software.removeprefix("cogmap ")

    with pytest.raises(LogError, match=f"recorded by {software}.*read it with cogmap {version}"):
        LogReader(path)


def test_the_oldest_version_read_is_one_constant(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with raw(path, "cogmap 0.1.0"):
        pass
    monkeypatch.setattr(versions, "OLDEST_READABLE", "0.1.0")

    assert list(LogReader(path).records()) == []

    monkeypatch.setattr(versions, "OLDEST_READABLE", "0.2.0")
    with pytest.raises(LogError, match=r"reads logs from 0\.2\.0 on"):
        LogReader(path)


def test_a_log_that_another_tool_copied_is_known_by_its_recording(path: Path) -> None:
    with raw(path, "mcap go v1.7.0") as writer:
        writer.add_metadata("recording", {"software": f"cogmap {VERSION}"})

    assert LogReader(path).about("recording")


def test_a_file_of_another_program_is_refused_with_its_name(path: Path) -> None:
    with raw(path, "rosbag2"):
        pass

    with pytest.raises(LogError, match="is not one of our logs: rosbag2 wrote it"):
        LogReader(path)


def test_a_recovered_log_keeps_the_version_that_recorded_it(path: Path, tmp_path: Path) -> None:
    with raw(path, "cogmap 0.0.9"):
        pass
    recover(path, tmp_path / "saved.mcap")

    with pytest.raises(LogError, match="read it with cogmap 0\\.0\\.9"):
        LogReader(tmp_path / "saved.mcap")
