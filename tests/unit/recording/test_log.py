"""A log read from Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from cogmap.errors import LogError, UsageError
from cogmap.recording import open_log
from cogmap.recording.storage.writer import LogWriter
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.examples import example_messages
from cogmap.schemas.graph import Delta
from cogmap.schemas.sensing import Odometry
from cogmap.testing import odometry, of_type
from cogmap.version import VERSION
from tests.support.logs import SECOND_NS, write_log

START_NS = 100 * SECOND_NS


def delta(version: int) -> Delta:
    example = of_type(Delta, example_messages())[0]
    return structs.replace(example, seq=version, source="workspace", version=version, operations=[])


def write(path: Path, *rows: tuple[float, Message]) -> Path:
    """A log of messages, each with the seconds into the log when it was received."""
    timed = []
    for time_s, message in rows:
        at_ns = START_NS + round(time_s * SECOND_NS)
        timed.append((at_ns, message))

    return write_log(path, timed, config='{"workspace": {"cell_m": 0.5}}')


@pytest.fixture
def path(tmp_path: Path) -> Path:
    rows: list[tuple[float, Message]] = [
        (0.0, odometry(0)),
        (0.5, delta(1)),
        (1.0, odometry(1)),
        (1.5, delta(2)),
        (2.0, odometry(2)),
        (2.5, delta(3)),
        (3.0, odometry(3)),
    ]
    return write(tmp_path / "log.mcap", *rows)


def test_messages_come_typed_and_in_the_order_of_their_receipt(path: Path) -> None:
    entries = list(open_log(path).messages())
    types = [type(entry.message) for entry in entries]
    times_s = [entry.time_s for entry in entries]

    assert types[:3] == [Odometry, Delta, Odometry]
    assert times_s == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]


def test_messages_can_be_chosen_by_topic_and_time(path: Path) -> None:
    log = open_log(str(path))
    first, second = log.messages("odometry", start_s=1.0, end_s=3.0)

    assert first.message == odometry(1)
    assert second.message == odometry(2)
    assert first.topic == second.topic == "odometry"
    assert first.log_time_ns == START_NS + SECOND_NS


def test_an_entry_has_the_envelope_that_its_message_came_with(path: Path) -> None:
    entry = next(open_log(path).messages("workspace/delta"))

    assert entry.envelope is not None
    assert (entry.envelope.source, entry.envelope.seq) == ("workspace", 1)


def test_a_log_knows_its_recorder_agent_configuration_and_length(path: Path) -> None:
    log = open_log(path)

    assert log.software == f"cogmap {VERSION}"
    assert log.agent == "a"
    assert log.duration_s == 3.0
    assert log.config == {"workspace": {"cell_m": 0.5}}
    assert {"odometry", "workspace/delta"} <= set(log.topics)


def test_the_graph_at_a_time_has_every_delta_received_up_to_it(path: Path) -> None:
    log = open_log(path)

    assert log.graph_at(0.0).version == 0
    assert log.graph_at(1.5).version == 2
    assert log.graph_at(1e6).version == 3


def test_a_log_that_lacks_a_delta_gives_no_graph_after_it(tmp_path: Path) -> None:
    path = write(tmp_path / "log.mcap", (0.0, delta(1)), (1.0, delta(3)))
    log = open_log(path)

    assert log.graph_at(0.5).version == 1
    with pytest.raises(LogError, match="holds delta 3 after delta 1"):
        log.graph_at(1.0)


def test_an_unknown_topic_is_named(path: Path) -> None:
    log = open_log(path)

    with pytest.raises(UsageError, match="did you mean 'odometry'"):
        list(log.messages("odometri"))


def test_messages_can_be_chosen_by_a_constant_of_the_table(path: Path) -> None:
    with open_log(path) as log:
        by_constant = [entry.log_time_ns for entry in log.messages(topics.ODOMETRY)]
        by_name = [entry.log_time_ns for entry in log.messages("odometry")]

    assert by_constant == by_name


@pytest.mark.parametrize("wrong", [["odometry"], Odometry])
def test_what_is_no_topic_is_refused_in_a_sentence(path: Path, wrong: Any) -> None:
    with open_log(path) as log, pytest.raises(UsageError, match="is no topic: give each"):
        list(log.messages(wrong))


def test_a_message_that_does_not_fit_its_topic_is_named(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    writer = LogWriter(path, [topics.ODOMETRY], {"agent": "a"})
    writer.write(topics.ODOMETRY, b"\xc1", None, 1)
    writer.close()
    log = open_log(path)

    with pytest.raises(LogError, match="a message cannot be read: odometry"):
        list(log.messages())


def test_what_is_missing_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no log"):
        open_log(tmp_path / "absent.mcap")
