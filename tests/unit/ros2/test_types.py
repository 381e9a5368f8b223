"""Hashes of types, and messages as CDR, as other libraries have them."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk.utils import get_type_hash

from cogmap.errors import MessageError, UsageError
from cogmap.ros2.rmw.types import NO_HASH, Types

STORE = get_typestore(Stores.ROS2_JAZZY)
TWIST = "geometry_msgs/msg/Twist"
GRID = "nav_msgs/msg/OccupancyGrid"


def definition(kind: str) -> str:
    text, _ = STORE.generate_msgdef(kind, ros_version=2)
    return str(text)


@pytest.mark.parametrize(
    ("kind", "published"),
    [
        (
            "std_msgs/msg/String",
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        ),
        (TWIST, "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
    ],
)
def test_hashes_are_those_that_ros_publishes(kind: str, published: str) -> None:
    assert Types("jazzy").hash_of(kind) == published


def test_another_library_computes_the_same_hash() -> None:
    parts = {"geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z"}
    theirs = get_type_hash(
        TWIST, msg_definition="Vector3 linear\nVector3 angular", dependencies=parts
    )

    assert Types("kilted").hash_of(TWIST) == theirs


def test_humble_has_no_hashes() -> None:
    assert Types("humble").hash_of(TWIST) == NO_HASH


def test_another_library_reads_our_twist() -> None:
    types = Types("jazzy")
    content = types.encoded(types.messages.twist(0.25, -0.5))

    assert content[:4] == b"\x00\x01\x00\x00"
    read = generate_dynamic(TWIST, definition(TWIST))[TWIST](content)
    assert (read.linear.x, read.linear.y, read.angular.z) == (0.25, 0.0, -0.5)


def test_another_library_reads_our_grid() -> None:
    types = Types("jazzy")
    percent = np.array([[-1, 0, 100], [50, 7, 8]], np.int8)
    header = types.messages.header(1_500_000_000, "map")
    content = types.encoded(types.messages.grid(header, percent, 0.5, (-1.0, 2.0)))

    read = generate_dynamic(GRID, definition(GRID))[GRID](content)
    assert (read.header.stamp.sec, read.header.stamp.nanosec) == (1, 500_000_000)
    assert (read.info.width, read.info.height, read.info.resolution) == (3, 2, 0.5)
    assert (read.info.origin.position.x, read.info.origin.position.y) == (-1.0, 2.0)
    assert list(read.data) == [-1, 0, 100, 50, 7, 8]


def test_we_read_what_another_library_writes() -> None:
    given = {"linear": {"x": 1.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 2.0}}
    content = serialize_dynamic(TWIST, definition(TWIST))[TWIST](given)

    read = Types("jazzy").decoded(content, TWIST)

    assert (read.linear.x, read.angular.z) == (1.0, 2.0)


@pytest.mark.parametrize("content", [b"", b"\x00\x01\x00\x00", bytes(20)])
def test_what_is_cut_off_is_named(content: bytes) -> None:
    with pytest.raises(MessageError, match=f"{len(content)} bytes are no {TWIST}"):
        Types("jazzy").decoded(content, TWIST)


def test_the_extra_is_named_where_a_library_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xxhash", None)

    with pytest.raises(UsageError, match=r"pip install 'cogmap\[ros2\]'"):
        Types("jazzy")
