"""The messages of a topic as a table."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import UsageError
from cogmap.recording import open_log
from cogmap.recording.storage.format import LOG_NAME
from cogmap.recording.table import table
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.examples import example_messages
from cogmap.schemas.nodes import PathColumn
from cogmap.schemas.sensing import Percept, Percepts, Pose, RangeScan, TruePose
from cogmap.schemas.topics import Topic
from cogmap.testing import odometry, of_type
from tests.support.logs import SECOND_NS, write_log
from tests.support.reference import REFERENCE

TRUE_POSE = TruePose(pose=Pose(x_m=1.0, y_m=2.0, heading_rad=0.5), travelled_m=3.0, progress=0.0)


def write(folder: Path, *messages: Message) -> Path:
    """A run's folder with a log of these messages, a second apart."""
    timed = [(SECOND_NS * (100 + number), one) for number, one in enumerate(messages)]
    write_log(folder / LOG_NAME, timed)
    return folder


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_messages_of_every_topic_become_a_table(topic: Topic) -> None:
    messages = of_type(topic.type, example_messages())
    made = table(topic.type, [(float(number), one) for number, one in enumerate(messages)])

    assert made.num_rows == len(messages)
    assert made.column_names[:4] == ["time_s", "stamp_ns", "seq", "source"]


def test_a_frame_has_a_row_a_message_with_the_time_of_its_receipt(tmp_path: Path) -> None:
    with open_log(write(tmp_path, odometry(0), TRUE_POSE, odometry(1))) as log:
        frame = log.frame("odometry")
        late = log.frame("odometry", start_s=1.0)

    assert frame["time_s"].to_pylist() == [0.0, 2.0]
    assert frame["seq"].to_pylist() == [0, 1]
    assert late["seq"].to_pylist() == [1]


def test_the_fields_of_a_part_are_columns_of_their_own(tmp_path: Path) -> None:
    frame = open_log(write(tmp_path, TRUE_POSE)).frame(topics.TRUE_POSE)

    assert frame["pose.x_m"].to_pylist() == [1.0]
    assert frame["pose.heading_rad"].to_pylist() == [0.5]
    assert frame["travelled_m"].to_pylist() == [3.0]


def test_an_array_can_be_had_back_from_its_parts(tmp_path: Path) -> None:
    range_m = np.array([1.5, 0.0], np.float32)
    scan = RangeScan(frame=0, bearing_rad=Array.of(range_m), range_m=Array.of(range_m))
    (parts,) = open_log(write(tmp_path, scan)).frame("sensory/scan")["range_m"].to_pylist()

    found = np.frombuffer(parts["data"], parts["dtype"]).reshape(parts["shape"])
    assert found.tolist() == range_m.tolist()


def test_a_part_in_a_list_has_its_fields_and_names(tmp_path: Path) -> None:
    percepts = of_type(Percepts, example_messages())[0]
    expected: Percept = percepts.objects[0]
    frame = open_log(write(tmp_path, percepts)).frame(topics.PERCEPTS)
    found = frame["objects"].to_pylist()[0][0]

    assert found["range_m"] == expected.range_m
    assert dict(found["names"]) == expected.names


def test_messages_can_be_chosen_by_the_constant_of_their_topic(tmp_path: Path) -> None:
    log = open_log(write(tmp_path, odometry(0), TRUE_POSE))

    assert [entry.message for entry in log.messages(topics.ODOMETRY)] == [odometry(0)]


def test_a_frame_of_an_unknown_topic_is_refused_with_one_that_is_meant(tmp_path: Path) -> None:
    log = open_log(write(tmp_path, odometry(0)))

    with pytest.raises(UsageError, match="did you mean 'odometry'"):
        log.frame("odometri")


def test_without_pyarrow_it_is_said_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    log = open_log(write(tmp_path, odometry(0)))

    with pytest.raises(UsageError, match=r"pip install 'cogmap\[tables\]'"):
        log.frame("odometry")


def test_the_path_has_a_row_for_each_place_as_it_was_believed() -> None:
    log = open_log(REFERENCE)
    path = log.path_frame()
    (segment,) = log.graph_at(log.duration_s).path
    rows = segment.rows.numpy()

    assert path.num_rows == len(rows)
    assert path["stamp_s"].to_pylist() == rows[:, PathColumn.STAMP_S].tolist()
    assert path["heading_rad"].to_pylist() == rows[:, PathColumn.HEADING_RAD].tolist()
    assert log.path_frame(0.0).num_rows == 0
