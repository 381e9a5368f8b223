"""Comparing two logs, and the words for their first difference."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from cogmap.bus.codec import encode
from cogmap.recording.diff import Diff, diff
from cogmap.recording.replaying.compare import describe, difference
from cogmap.schemas import topics
from cogmap.schemas.array import Array, Matrix
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta, DropNode, Link, Phase
from cogmap.schemas.nodes import Node
from cogmap.schemas.sensing import Odometry, RangeScan
from cogmap.testing import odometry, of_type
from tests.support.logs import scan, write_log

Change = Callable[[list[Message]], object]


def messages() -> list[Message]:
    """Ten rows of odometry and scans of two sources."""
    found: list[Message] = []
    for seq in range(10):
        stamp_ns = seq * 10**8
        found.append(odometry(seq, stamp_ns=stamp_ns, speed_m_s=2.0))
        found.append(scan(seq, stamp_ns=stamp_ns, values=Array.of(_values() + seq)))

    return found


def _values() -> np.ndarray:
    return np.arange(6, dtype=np.float32).reshape(2, 3)


def record(
    path: Path, recorded: Iterable[Message], delay_ns: int = 0, incarnation: int = 1
) -> Path:
    rows = []
    for number, message in enumerate(recorded):
        rows.append((1000 * number + delay_ns, message))

    return write_log(path, rows, incarnation=incarnation)


def compared(folder: Path, change: Change, delay_ns: int = 0, incarnation: int = 1) -> Diff:
    """Messages and what `change` makes of them, each in a log of its own."""
    changed = messages()
    change(changed)

    left = record(folder / "a.mcap", messages())
    right = record(folder / "b.mcap", changed, delay_ns, incarnation)
    return diff(left, right)


def test_logs_of_the_same_messages_are_the_same_however_they_travelled(tmp_path: Path) -> None:
    def reorder(other: list[Message]) -> None:
        other.sort(key=lambda message: message.source)

    found = compared(tmp_path, reorder, delay_ns=77, incarnation=9)
    same = {compared.topic: compared.same for compared in found.topics}

    assert found.same
    assert found.first == ""
    assert same == {"odometry": 10, "sensory/scan": 10}


def test_a_changed_value_is_found_and_named(tmp_path: Path) -> None:
    def change(other: list[Message]) -> None:
        other[8] = msgspec.structs.replace(other[8], speed_m_s=2.5)
        other[12] = msgspec.structs.replace(other[12], speed_m_s=9.0)

    found = compared(tmp_path, change)
    different = {compared.topic: compared.different for compared in found.topics}

    assert found.first == (
        "odometry number 4 of sim (stamp 0.400 s): speed_m_s is 2.0 in a.mcap, 2.5 in b.mcap"
    )
    assert different == {"odometry": 2, "sensory/scan": 0}


def test_a_changed_value_in_an_array_is_named_with_its_index(tmp_path: Path) -> None:
    def change(other: list[Message]) -> None:
        values = np.arange(6, dtype=np.float32).reshape(2, 3) + 1
        values[1, 0] = 0.5
        other[3] = msgspec.structs.replace(other[3], range_m=Array.of(values))

    assert compared(tmp_path, change).first == (
        "sensory/scan number 1 of sensory (stamp 0.100 s): "
        "range_m.1.0 is 4.0 in a.mcap, 0.5 in b.mcap (1 of 6 values differ)"
    )


def test_a_message_in_one_log_only_is_named(tmp_path: Path) -> None:
    found = compared(tmp_path, lambda other: other.pop(18))
    assert found.first == "odometry number 9 of sim (stamp 0.900 s) is in a.mcap and not in b.mcap"

    first = found.topics[0]
    assert first.left == 10
    assert first.right == 9
    assert first.left_only == 1


def test_only_the_chosen_topics_are_compared(tmp_path: Path) -> None:
    left = record(tmp_path / "a.mcap", messages())
    scans = of_type(RangeScan, messages())
    right = record(tmp_path / "b.mcap", scans)

    assert not diff(left, right).same
    assert diff(left, right, [topics.SCAN]).same


def _delta(*operations: Node | Link | DropNode) -> Delta:
    return Delta(version=1, cycle=1, phase=Phase.OBJECTS, tasks=["t"], operations=list(operations))


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [
        (
            _delta(DropNode(id="a")),
            _delta(DropNode(id="b")),
            "operations.0.id is 'a' in A, 'b' in B",
        ),
        (_delta(DropNode(id="a")), _delta(), "the length of operations is 1 in A, 0 in B"),
        (
            _delta(DropNode(id="a")),
            _delta(Node(id="a", kind="k")),
            "operations.0 is DropNode in A, Node in B",
        ),
        (
            _delta(Node(id="a", kind="k", attributes={"x": 1.0})),
            _delta(Node(id="a", kind="k", attributes={"y": 1.0})),
            "operations.0.attributes.x is 1.0 in A, absent in B",
        ),
        (
            _delta(Node(id="a", kind="k", samples=Matrix.of(np.zeros((2, 2))))),
            _delta(Node(id="a", kind="k", samples=Matrix.of(np.zeros((3, 2))))),
            "the kind of operations.0.samples is <f8 (2, 2) in A, <f8 (3, 2) in B",
        ),
        (
            _delta(Node(id="a", kind="k", samples=Matrix.of([[0.0, -0.0]]))),
            _delta(Node(id="a", kind="k", samples=Matrix.of([[0.0, 0.0]]))),
            "operations.0.samples.0.1 is -0.0 in A, 0.0 in B (1 of 2 values differ)",
        ),
    ],
)
def test_a_difference_deep_in_a_message_is_put_in_words(
    left: Delta, right: Delta, words: str
) -> None:
    found = difference(left, right)

    assert found is not None
    assert found.in_words(("A", "B")) == words


def test_the_same_values_in_other_bytes_are_named_by_the_first_byte() -> None:
    row = Odometry(speed_m_s=2.0, turn_rate_rad_s=0.0, dt_s=0.05)
    left = encode(row)
    right = left.replace(b"\xcb\x40\x00\x00\x00\x00\x00\x00\x00", b"\x02")

    assert left != right

    words = describe(topics.ODOMETRY, left, right, ("A", "B"))
    assert "the same values in other bytes, from byte" in words
