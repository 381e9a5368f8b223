"""Writes a log as a bag of ROS 2, MCAP in a folder, by the library rosbags."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from cogmap.errors import UsageError
from cogmap.recording.exporting.moments import moments
from cogmap.recording.exporting.ros_drive import LATCHED, RosDrive
from cogmap.recording.exporting.ros_messages import RosMessages, latched
from cogmap.recording.log import Log
from cogmap.recording.storage.reader import Progress
from cogmap.schemas import topics

BAG_VERSION = 9
_SENSES = (topics.STEREO, topics.VIEW, topics.SCAN, topics.MOTOR_COMMAND)
_WHEELS = (topics.ODOMETRY, topics.SELF_MOTION)
"""The first one that the log has messages of is the odometry: the wheels', or what views tell."""


def write_rosbag2(log: Log, folder: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the drive in `log` as a bag in the new folder `folder`. Returns the number of messages
    by topic.

    `/camera/left`, `/camera/right` and `/camera/depth` are images, each with its `camera_info`,
    `/odom` the self-motion, `/scan` the points of a range scan, `/cmd_vel` the motor commands;
    `/pose` is what the agent believes, `/path`, `/plan`, `/objects` and `/map` what it has mapped,
    `/tf` and `/tf_static` the frames, `/needs/NAME` how strong a need is, `/rosout` what became
    conscious and what processes report, `/truth` where the robot is, in a frame of its own. Raises
    UsageError if the folder exists or the library is not installed, and LogError if the log is
    damaged.
    """
    rosbag2, store = _library()
    mcap = rosbag2.StoragePlugin.MCAP
    try:
        writer = rosbag2.Writer(folder, version=BAG_VERSION, storage_plugin=mcap)
    except rosbag2.WriterError:
        raise UsageError(f"{folder} exists already: name a new folder") from None

    measured = [topic for topic in _WHEELS if next(log.messages(topic), None) is not None]
    with writer:
        bag = _Bag(writer, store)
        drive = RosDrive(RosMessages(store))
        for moment in moments(log, (*_SENSES, *measured[:1]), progress):
            for topic, message in drive.shown(moment.stamp_ns, moment.content):
                bag.write(moment.stamp_ns, topic, message)
    return dict(bag.written)


class _Bag:
    """Writes messages of ROS, each on its topic."""

    def __init__(self, writer: Any, store: Any) -> None:
        self.written: Counter[str] = Counter()
        self._writer = writer
        self._store = store
        self._connections: dict[str, Any] = {}

    def write(self, stamp_ns: int, topic: str, message: Any) -> None:
        kind = message.__msgtype__
        connection = self._connections.get(topic)
        if connection is None:
            quality = [latched()] if topic in LATCHED else []
            connection = self._writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=quality
            )
            self._connections[topic] = connection
        content = self._store.serialize_cdr(message, kind)
        self._writer.write(connection, stamp_ns, content)
        self.written[topic] += 1


def _library() -> tuple[Any, Any]:
    """Return the module of rosbags that writes bags, and its types of messages."""
    try:
        from rosbags import rosbag2
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError(
            "this needs the library rosbags: install it by `pip install 'cogmap[bags]'`"
        ) from None
    return rosbag2, get_typestore(Stores.ROS2_JAZZY)
