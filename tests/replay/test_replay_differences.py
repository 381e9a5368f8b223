"""What a replay names: the first difference, and what it could not feed."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from cogmap.errors import LogError
from cogmap.recording.replaying.replay import replay_into
from cogmap.recording.selection import to_record
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.storage.writer import LogWriter
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import RangeScan
from tests.replay.mixer import Sections, Session, build, clock, odometry, record, replay


def _shifted(name: str, sections: Sections, instance: str) -> Module:
    """A mixer of which one range is 1 m more, from its third scan of odometry on."""
    module = build(name, sections, instance)
    original = module.handlers[topics.ODOMETRY]
    scans = itertools.count()

    def handler(message: Message) -> Iterable[Message]:
        return [shift(reply) for reply in original(message)]

    def shift(reply: Message) -> Message:
        if not isinstance(reply, RangeScan) or next(scans) < 2:
            return reply
        values = reply.range_m.numpy().copy()
        values[1, 1] += 1
        return replace(reply, range_m=Array.of(values))

    module.handlers[topics.ODOMETRY] = handler
    return module


def _scan(path: Path, seq: int) -> RangeScan:
    """The scan of that number in a log."""
    reader = LogReader(path)
    for found in reader.records({topics.SCAN}):
        scan = reader.message(found)
        if isinstance(scan, RangeScan) and scan.seq == seq:
            return scan
    raise AssertionError(f"no scan {seq} in {path}")


def test_the_first_difference_names_message_field_and_both_values(path: Path) -> None:
    record(path)

    report = replay(path, _shifted)

    scan = _scan(path, seq=4)
    there = scan.range_m.numpy()[1, 1].item()
    here = np.float32(there + 1).item()
    assert not report.same
    assert report.first == (
        f"sensory/scan number 4 of mixer (stamp {scan.stamp_ns / 1e9:.3f} s): "
        f"range_m.1.1 is {there!r} in the log, "
        f"{here!r} in the replay (1 of 8 values differ)"
    )


def _silent(name: str, sections: Sections, instance: str) -> Module:
    """A mixer that publishes nothing of what it receives."""
    silent = {name: {"every": 1000}}
    return build(name, silent, instance)


def test_an_output_that_is_no_longer_published_is_named(path: Path) -> None:
    record(path)

    report = replay(path, _silent)

    assert not report.same
    assert "sensory/scan number 0 of mixer" in report.first
    assert report.first.endswith("is in the log and not published in the replay")


def _refusing(name: str, sections: Sections, instance: str) -> Module:
    module = build(name, sections, instance)
    module.handlers[topics.CLOCK] = lambda clock: 1 / 0
    return module


def test_an_input_that_is_refused_now_is_named(path: Path) -> None:
    record(path)

    report = replay(path, _refusing)

    refusal = "clock: mixer refuses what it received: ZeroDivisionError: division by zero"
    assert report.first == refusal


@contextmanager
def copying(source: Path, target: Path) -> Iterator[tuple[LogReader, LogWriter]]:
    """A reader of one log, and the writer of another, of the default configuration."""
    writer = LogWriter(target, to_record(), {"config": "{}"})
    yield LogReader(source), writer
    writer.close()


def test_inputs_that_the_log_lacks_are_counted_by_topic(path: Path, tmp_path: Path) -> None:
    record(path)
    thinner = tmp_path / "thinner.mcap"
    with copying(path, thinner) as (reader, writer):
        for found in reader.records():
            if found.topic is not topics.CLOCK:
                payload = reader.payload(found)
                writer.write(found.topic, payload, found.envelope, found.log_time_ns)

    report = replay(thinner)

    (outcome,) = report.outcomes
    assert outcome.missing_inputs == {"clock": 30}
    assert outcome.notes == ["inputs that the log lacks: 30 of clock"]
    assert not report.same


def without_envelopes(path: Path, folder: Path) -> Path:
    """A copy of the log, as one that another program has recorded."""
    bare = folder / "bare.mcap"
    with copying(path, bare) as (reader, writer):
        for record in reader.records():
            writer.write(record.topic, reader.payload(record), None, record.log_time_ns)
    return bare


def test_without_envelopes_inputs_are_fed_in_the_order_of_the_log(
    path: Path, tmp_path: Path
) -> None:
    session = Session(path)
    session.enter()
    for seq in range(20):
        session.publish(clock(seq), 10 * seq)
        session.publish(odometry(seq), 10 * seq)
        session.settle()
    session.end()
    bare = without_envelopes(path, tmp_path)

    report = replay(bare)

    (outcome,) = report.outcomes
    assert report.same, report.first
    assert outcome.same == 27
    assert outcome.notes == ["the log has no envelopes: inputs were fed in the order of the log"]


def test_without_envelopes_refused_inputs_are_counted_in_the_notes(
    path: Path, tmp_path: Path
) -> None:
    record(path)
    bare = without_envelopes(path, tmp_path)

    (outcome,) = replay(bare, _refusing).outcomes

    refusal = "clock: mixer refuses what it received: ZeroDivisionError: division by zero"
    assert f"30 inputs refused, the first: {refusal}" in outcome.notes


def test_a_module_that_published_nothing_is_named_with_those_that_did(path: Path) -> None:
    record(path)
    sentence = "nothing that module epam published: there are mixer, sim"

    with pytest.raises(LogError, match=sentence):
        replay_into(path, ["epam"], build)
