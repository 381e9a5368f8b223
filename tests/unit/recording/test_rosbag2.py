"""A log as a bag of ROS 2, read back by the library that wrote it, and by that of MCAP."""

from __future__ import annotations

import math
import sys
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from cogmap.errors import UsageError
from cogmap.geometry.se2 import compose
from cogmap.graph.graph import Graph
from cogmap.recording import open_log
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.schemas import topics
from cogmap.schemas.nodes import ROOT_MAP, Need, Object
from cogmap.schemas.sensing import Odometry, StereoFrame, View
from cogmap.testing import self_motion
from tests.support.logs import SECOND_NS, delta, write_log
from tests.support.reference import REFERENCE

Messages = dict[str, list[Any]]
CHAIN = [("map", "odom"), ("odom", "base_link")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The reference drive as a bag."""
    written = tmp_path_factory.mktemp("rosbag2") / "bag"
    write_rosbag2(open_log(REFERENCE), written)
    return written


def _read(folder: Path) -> Messages:
    """The messages of a bag by topic, as rosbags reads them."""
    found = defaultdict(list)
    with AnyReader([folder]) as reader:
        for connection, _, content in reader.messages():
            found[connection.topic].append(reader.deserialize(content, connection.msgtype))
    return found


@pytest.fixture(scope="module")
def messages(folder: Path) -> Messages:
    return _read(folder)


@pytest.fixture(scope="module")
def graph() -> Graph:
    log = open_log(REFERENCE)
    return log.graph_at(log.duration_s)


def test_nothing_is_lost(messages: Messages, tmp_path: Path) -> None:
    written = write_rosbag2(open_log(REFERENCE), tmp_path / "again")
    counts = {topic: len(each) for topic, each in messages.items()}

    assert counts == written
    log = open_log(REFERENCE)
    frames = len(list(log.messages(topics.STEREO)))
    assert counts["/camera/left/image_raw"] == counts["/camera/right/camera_info"] == frames
    assert counts["/camera/depth/image_rect"] == len(list(log.messages(topics.VIEW)))
    assert counts["/cmd_vel"] == len(list(log.messages(topics.MOTOR_COMMAND)))
    assert counts["/truth"] == len(list(log.messages(topics.TRUE_POSE)))
    assert counts["/odom"] == 1 + len(list(log.messages(topics.ODOMETRY)))


def test_another_reader_reads_the_same(folder: Path, messages: Messages) -> None:
    counts: Counter[str] = Counter()
    pixels = []
    with (folder / f"{folder.name}.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            if channel.topic == "/camera/left/image_raw":
                pixels.append(bytes(message.data))

    assert counts == {topic: len(each) for topic, each in messages.items()}
    assert pixels == [each.data.tobytes() for each in messages["/camera/left/image_raw"]]


def test_images_are_those_of_the_cameras(messages: Messages) -> None:
    frame = next(iter(open_log(REFERENCE).messages(topics.STEREO))).message
    view = next(iter(open_log(REFERENCE).messages(topics.VIEW))).message
    assert isinstance(frame, StereoFrame)
    assert isinstance(view, View)
    right = messages["/camera/right/image_raw"][0]
    depth = messages["/camera/depth/image_rect"][0]

    assert (right.encoding, right.step) == ("rgb8", 3 * right.width)
    assert np.array_equal(right.data.reshape(frame.right.shape), frame.right.numpy())
    assert np.array_equal(depth.data.view("<f4").reshape(view.depth_m.shape), view.depth_m.numpy())


def test_the_right_camera_states_the_baseline(messages: Messages) -> None:
    frame = next(iter(open_log(REFERENCE).messages(topics.STEREO))).message
    assert isinstance(frame, StereoFrame)
    left = messages["/camera/left/camera_info"][0]
    right = messages["/camera/right/camera_info"][0]

    assert left.p[3] == 0
    assert -right.p[3] / right.p[0] == pytest.approx(frame.calibration.baseline_m)
    assert (right.width, right.height) == (frame.calibration.width_px, frame.calibration.height_px)


def test_odometry_leads_where_the_wheels_did(messages: Messages) -> None:
    first, *_, last = messages["/odom"]
    entries = open_log(REFERENCE).messages(topics.ODOMETRY)
    driven = [entry.message for entry in entries if isinstance(entry.message, Odometry)]

    assert (first.pose.pose.position.x, first.pose.pose.position.y) == (0.0, 0.0)
    turned_rad = 2 * math.atan2(last.pose.pose.orientation.z, last.pose.pose.orientation.w)
    assert turned_rad == pytest.approx(sum(each.turn_rate_rad_s * each.dt_s for each in driven))
    assert last.twist.twist.linear.x == driven[-1].speed_m_s


def test_without_wheels_the_odometry_is_what_the_views_tell(tmp_path: Path) -> None:
    steps = [(1.0, 0.0, 0.1, 0.1, 0.1), (3.0, 0.0, 0.1, 0.1, 0.1)]
    told = [self_motion(frame, steps) for frame in (1, 2)]
    log = write_log(tmp_path / "log.mcap", [(each.stamp_ns, each) for each in told])

    write_rosbag2(open_log(log), tmp_path / "bag")

    moved = _read(tmp_path / "bag")["/odom"]
    assert [each.pose.pose.position.x for each in moved] == pytest.approx([0, 0.1, 0.4, 0.5, 0.8])
    stamps_ns = [10**9 * each.header.stamp.sec + each.header.stamp.nanosec for each in moved]
    assert np.diff(stamps_ns).tolist() == [10**8] * 4


def _planar(transform: Any) -> list[float]:
    turn = transform.rotation
    moved = transform.translation
    return [moved.x, moved.y, 2 * math.atan2(turn.z, turn.w)]


def test_frames_lead_from_the_map_to_the_robot_where_the_agent_believes_it_is(
    messages: Messages, graph: Graph
) -> None:
    transforms = [message.transforms[0] for message in messages["/tf"]]
    last = {(each.header.frame_id, each.child_frame_id): each.transform for each in transforms}
    agent = graph.agent
    assert agent is not None

    robot = compose(*(np.array(_planar(last[pair])) for pair in CHAIN))

    assert last.keys() == set(CHAIN)
    assert robot == pytest.approx([agent.x_m, agent.y_m, agent.heading_rad])
    pose = messages["/pose"][-1].pose
    assert (pose.pose.position.x, pose.pose.position.y) == pytest.approx((agent.x_m, agent.y_m))
    assert pose.covariance[0] == pytest.approx(agent.x_sd_m**2)


def test_the_map_has_every_object_and_place(messages: Messages, graph: Graph) -> None:
    markers = messages["/objects"][-1].markers
    nodes = [node for node in graph.of_kind(Object) if node.map == ROOT_MAP]
    grid = messages["/map"][-1]

    boxes = [marker for marker in markers if marker.ns == "objects"]
    places = [(marker.pose.position.x, marker.pose.position.y) for marker in boxes]
    assert places == [(node.x_m, node.y_m) for node in nodes]
    assert (grid.info.width, grid.info.height) == graph.places.extent(ROOT_MAP).shape
    assert set(np.unique(grid.data)) <= set(range(-1, 101))
    assert messages["/path"][-1].poses


def test_what_became_conscious_is_in_the_log_of_ros(messages: Messages) -> None:
    assert any("conscious" in line.msg for line in messages["/rosout"])


def test_a_folder_that_exists_is_left_alone(folder: Path) -> None:
    with pytest.raises(UsageError, match="exists already"):
        write_rosbag2(open_log(REFERENCE), folder)


def test_without_the_library_the_remedy_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags", None)

    with pytest.raises(UsageError, match=r"cogmap\[bags\]"):
        write_rosbag2(open_log(REFERENCE), tmp_path / "bag")


def test_needs_are_numbers(tmp_path: Path) -> None:
    need = Need(id="need:energy", label="energy", level=0.25)
    log = write_log(tmp_path / "log.mcap", [(SECOND_NS, delta(1, need))])
    write_rosbag2(open_log(log), tmp_path / "bag")

    assert [each.data for each in _read(tmp_path / "bag")["/needs/energy"]] == [0.25]
