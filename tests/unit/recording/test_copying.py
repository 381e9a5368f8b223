"""A part of a log as another, and several logs as one."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.writer import CompressionType

from cogmap.errors import StorageError, UsageError
from cogmap.recording.copying import Part, copy
from cogmap.recording.info import info
from cogmap.recording.selection import to_play, to_record
from cogmap.recording.storage.reader import LogReader, Record
from cogmap.schemas import topics
from cogmap.schemas.topics import Scope
from cogmap.testing import odometry
from tests.support.logs import SECOND_NS, scan, write_log
from tests.support.reference import REFERENCE

START_NS = 100 * SECOND_NS
WHOLE = Part(topics=to_record())


def drive(path: Path, first: int = 0, end: int = 10, **about: str) -> Path:
    """A log of odometry and scans, one of each a second, with numbers from `first` to `end`."""
    rows = []
    for number in range(first, end):
        at_ns = START_NS + number * SECOND_NS
        rows += [(at_ns, odometry(number)), (at_ns + 1, scan(number))]
    return write_log(path, rows, **about)


def numbers(path: Path, topic: topics.Topic) -> list[int]:
    return [record.sequence for record in LogReader(path).records([topic])]


def contents(path: Path) -> list[tuple[Record, bytes]]:
    """Every message with all that is known of it but its place in the file."""
    reader = LogReader(path)
    found = []
    for record in reader.records():
        facts = record.topic_name, record.log_time_ns, record.publish_ns, record.envelope
        found.append((facts, reader.payload(record)))
    return found


@pytest.mark.parametrize("compression", CompressionType)
def test_a_whole_log_keeps_every_byte_and_time(
    tmp_path: Path, compression: CompressionType
) -> None:
    target = tmp_path / "copy.mcap"

    copied = copy([REFERENCE], target, WHOLE, compression=compression)

    assert contents(target) == contents(REFERENCE)
    assert copied.size_bytes == target.stat().st_size
    assert info(target).finished
    assert info(target).config == info(REFERENCE).config


def test_a_part_has_the_topics_and_times_that_are_chosen(tmp_path: Path) -> None:
    source = drive(tmp_path / "drive.mcap")
    target = tmp_path / "part.mcap"

    part = Part(topics=[topics.ODOMETRY], start_s=2.0, end_s=5.0)
    copied = copy([source], target, part)

    assert copied.messages == {"odometry": 3}
    assert copied.duration_s == 2.0
    assert numbers(target, topics.ODOMETRY) == [2, 3, 4]
    assert info(target).gaps == []


def test_logs_become_one_in_which_each_message_is_once(tmp_path: Path) -> None:
    early = drive(tmp_path / "early.mcap", 0, 6)
    late = drive(tmp_path / "late.mcap", 4, 10)
    target = tmp_path / "whole.mcap"

    copied = copy([late, early], target, WHOLE)

    assert contents(target) == contents(drive(tmp_path / "drive.mcap"))
    assert copied.twice == 4


def test_what_is_missing_between_logs_is_a_gap(tmp_path: Path) -> None:
    early = drive(tmp_path / "early.mcap", 0, 3)
    late = drive(tmp_path / "late.mcap", 5, 6)

    copy([early, late], tmp_path / "whole.mcap", WHOLE)

    found = info(tmp_path / "whole.mcap")
    assert "odometry (never drop): 2 of sim missing, number 3 to 4" in found.gaps


def test_logs_of_different_agents_are_not_merged(tmp_path: Path) -> None:
    one = drive(tmp_path / "one.mcap", agent="a")
    other = drive(tmp_path / "other.mcap", agent="b")

    with pytest.raises(UsageError, match=r"is of agent 'a', and .* of 'b': merge logs"):
        copy([one, other], tmp_path / "whole.mcap", WHOLE)


def test_an_empty_part_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    source = drive(tmp_path / "drive.mcap")

    with pytest.raises(UsageError, match="holds no message of these topics and times"):
        copy([source], tmp_path / "part.mcap", Part(topics=[topics.DELTA]))
    assert not (tmp_path / "part.mcap").exists()


def test_a_log_that_is_there_stays(tmp_path: Path) -> None:
    source = drive(tmp_path / "drive.mcap")

    with pytest.raises(StorageError, match="exists already"):
        copy([source], source, WHOLE)


def test_facts_about_processes_are_played_only_where_they_are_asked_for() -> None:
    scopes = {topic.scope for topic in to_play(exclude="^truth/")}

    assert scopes == {Scope.MODEL}
    assert to_play(["health"]) == [topics.HEALTH]
    assert topics.PRESENCE in to_play(regex="^presence")
