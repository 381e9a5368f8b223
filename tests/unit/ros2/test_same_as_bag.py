"""What a robot sends live is sensed as a bag of the same messages is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from cogmap.data.bags.topics import ODOMETRY, Topics
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose
from cogmap.recording import open_log
from cogmap.recording.exporting.ros_drive import arc_of
from cogmap.recording.exporting.rosbag2 import write_rosbag2
from cogmap.ros2.graph import RosGraph, chosen
from cogmap.ros2.rmw.keys import End, Seen, Stream
from cogmap.ros2.senses import Senses
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, StereoFrame
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from tests.support.reference import REFERENCE

UNCALIBRATED = 1
"""Views before the calibration of the right camera, which the bag has after its first image."""


def live(bag: Path) -> list[Message]:
    """What is sensed of the messages of a bag as they come, in the order of their recording."""
    with AnyReader([bag]) as reader:
        graph = RosGraph()
        for each in reader.connections:
            stream = Stream(each.topic, each.msgtype, "")
            graph.update(Seen(each.topic, "robot", End.PUBLISHER, stream), True)
        given = Topics("/camera/left/image_raw", "/camera/right/image_raw")
        found = chosen(graph, given, ODOMETRY)
        senses = Senses(found, graph.topics, height_m=0.0, period_ns=1)
        receive = {wanted.topic: wanted.receive for wanted in senses.wanted()}

        sensed: list[Message] = []
        for connection, _, content in reader.messages():
            if connection.topic in receive:
                message: Any = reader.deserialize(content, connection.msgtype)
                sensed += receive[connection.topic](message, 0)
    return sensed


def end_of(moved: list[Odometry]) -> Floats:
    """Where motions lead to, from where they began."""
    pose: Floats = np.zeros(3)
    for each in moved:
        pose = compose(pose, arc_of(each))
    return pose


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive through the town, as a bag of ROS 2."""
    folder = tmp_path_factory.mktemp("ros2") / "bag"
    write_rosbag2(open_log(REFERENCE), folder)
    return folder


def test_frames_and_calibrations_are_those_of_the_bag(bag: Path) -> None:
    played = formats.opened(Config(recording=f"bag:{bag}"))
    frames = [each for each in live(bag) if isinstance(each, StereoFrame)]

    stamps_ns = [each.stamp_ns for each in frames]
    assert np.diff(stamps_ns).tolist() == np.diff(played.stamps_ns[UNCALIBRATED:]).tolist()
    for number, frame in enumerate(frames, start=UNCALIBRATED):
        (theirs,) = played.view(number)
        assert isinstance(theirs, StereoFrame)
        assert (frame.left, frame.right) == (theirs.left, theirs.right)
        assert frame.calibration == theirs.calibration


def test_the_motions_lead_where_those_of_the_bag_do(bag: Path) -> None:
    played = formats.opened(Config(recording=f"bag:{bag}"))
    numbers = range(UNCALIBRATED + 1, len(played.stamps_ns))
    theirs = [each for number in numbers for each in played.before(number)]
    ours = [each for each in live(bag) if isinstance(each, Odometry)]

    of_bag = [each for each in theirs if isinstance(each, Odometry)]
    assert sum(each.dt_s for each in ours) == pytest.approx(sum(each.dt_s for each in of_bag))
    assert end_of(ours) == pytest.approx(end_of(of_bag), abs=0.02)
