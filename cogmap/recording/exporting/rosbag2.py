"""Writes a log as a bag of ROS 2, MCAP in a folder, by the library rosbags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative
from cogmap.recording.exporting.moments import (
    OBJECT_HEIGHT_M,
    OBJECT_WIDTH_M,
    Map,
    Moment,
    Sentence,
    moments,
    points_of,
)
from cogmap.recording.exporting.ros_messages import (
    OPTICAL_AXES,
    Position,
    Quaternion,
    RosMessages,
    latched,
    turned,
)
from cogmap.recording.log import Log
from cogmap.recording.storage.reader import Progress
from cogmap.recording.views import depth
from cogmap.robot import TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas import topics
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Object, PlaceColumn, Self
from cogmap.schemas.sensing import (
    MotorCommand,
    Odometry,
    RangeScan,
    StereoFrame,
    TruePose,
    View,
)

BAG_VERSION = 9
MAP = "map"
ODOM = "odom"
ROBOT = "base_link"
LEFT = "left_camera_optical_frame"
RIGHT = "right_camera_optical_frame"
TOWN = "town"
"""Names of frames, by REP 103 and 105 where these have one."""

LATCHED = ("/tf_static", "/map")
"""Who subscribes late gets the last message, too."""

_SENSES = (topics.STEREO, topics.VIEW, topics.SCAN, topics.MOTOR_COMMAND)
_WHEELS = (topics.ODOMETRY, topics.SELF_MOTION)
"""The first one that the log has messages of is the odometry: the wheels', or what views tell."""


def write_rosbag2(log: Log, folder: Path, progress: Progress | None = None) -> dict[str, int]:
    """Write the drive in `log` as a bag in the new folder `folder`. Returns the number of messages
    by topic.

    `/camera/left`, `/camera/right` and `/camera/depth` are images, each with its `camera_info`,
    `/odom` the self-motion, `/scan` the points of a range scan, `/cmd_vel` the motor commands;
    `/pose` is what the agent believes, `/path`, `/plan`, `/objects` and `/map` what it has mapped,
    `/tf` and `/tf_static` the frames, `/rosout` what became conscious and what processes report,
    `/truth` where the robot is, in a frame of its own. Raises UsageError if the folder exists or
    the library is not installed, and LogError if the log is damaged.
    """
    rosbag2 = _library()
    mcap = rosbag2.StoragePlugin.MCAP
    try:
        writer = rosbag2.Writer(folder, version=BAG_VERSION, storage_plugin=mcap)
    except rosbag2.WriterError:
        raise UsageError(f"{folder} exists already: name a new folder") from None

    measured = [topic for topic in _WHEELS if next(log.messages(topic), None) is not None]
    with writer:
        drive = _Drive(writer)
        for moment in moments(log, (*_SENSES, *measured[:1]), progress):
            drive.take(moment)
    return dict(drive.written)


class _Drive:
    """Turns the moments of a drive into messages of ROS, and writes them."""

    def __init__(self, writer: Any) -> None:
        from rosbags.typesys import Stores, get_typestore

        self.written: Counter[str] = Counter()
        self._writer = writer
        self._store: Any = get_typestore(Stores.ROS2_JAZZY)
        self._ros = RosMessages(self._store)
        self._connections: dict[str, Any] = {}
        self._stamp_ns = 0
        self._odometry = np.zeros(3)
        self._has_mount = False
        self._writers: dict[type, Callable[[Any], None]] = {
            StereoFrame: self._write_pair,
            View: self._write_depth,
            RangeScan: self._write_scan,
            Odometry: self._write_odometry,
            MotorCommand: self._write_command,
            Self: self._write_pose,
            Sentence: self._write_sentence,
            TruePose: self._write_true_pose,
            Map: self._write_map,
        }

    def take(self, moment: Moment) -> None:
        """Write what there is to show."""
        self._stamp_ns = moment.stamp_ns
        self._writers[type(moment.content)](moment.content)

    def _write(self, topic: str, message: Any) -> None:
        kind = message.__msgtype__
        connection = self._connections.get(topic)
        if connection is None:
            quality = [latched()] if topic in LATCHED else []
            connection = self._writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=quality
            )
            self._connections[topic] = connection
        content = self._store.serialize_cdr(message, kind)
        self._writer.write(connection, self._stamp_ns, content)
        self.written[topic] += 1

    def _header(self, frame: str) -> Any:
        return self._ros.header(self._stamp_ns, frame)

    def _transform(self, parent: str, child: str, place_m: Position, turn: Quaternion) -> Any:
        return self._ros.transform(self._header(parent), child, place_m, turn)

    def _write_transforms(self, topic: str, *transforms: Any) -> None:
        self._write(topic, self._ros.make("tf2_msgs/msg/TFMessage", list(transforms)))

    def _write_pair(self, pair: StereoFrame) -> None:
        camera = pair.calibration
        if not self._has_mount:
            self._has_mount = True
            forward_m = (camera.mount_forward_m, 0.0, camera.mount_height_m)
            right = Rotation.from_rotvec(camera.right_rotation_rad).as_quat().tolist()
            aside_m = (camera.baseline_m, 0.0, 0.0)
            self._write_transforms(
                "/tf_static",
                self._transform(ROBOT, LEFT, forward_m, OPTICAL_AXES),
                self._transform(LEFT, RIGHT, aside_m, tuple(right)),
            )

        left = self._header(LEFT)
        right = self._header(RIGHT)
        self._write_image("/camera/left/image_raw", left, pair.left)
        self._write("/camera/left/camera_info", self._ros.left_camera(left, camera))
        self._write_image("/camera/right/image_raw", right, pair.right)
        self._write("/camera/right/camera_info", self._ros.right_camera(right, camera))

    def _write_image(self, topic: str, header: Any, image: Array) -> None:
        encoding = "rgb8" if len(image.shape) == 3 else "mono8"
        self._write(topic, self._ros.image(header, encoding, image.numpy()))

    def _write_depth(self, view: View) -> None:
        header = self._header(LEFT)
        depth_m = depth(view.depth_m, "the view's depth")
        self._write("/camera/depth/image_rect", self._ros.image(header, "32FC1", depth_m))
        camera = self._ros.left_camera(header, view.calibration)
        self._write("/camera/depth/camera_info", camera)

    def _write_scan(self, scan: RangeScan) -> None:
        self._write("/scan", self._ros.points(self._header(ROBOT), points_of(scan)))

    def _write_odometry(self, moved: Odometry) -> None:
        """Write the pose by odometry alone; before the first motion, that in which it began."""
        if not self.written["/odom"]:
            end_ns = self._stamp_ns
            self._stamp_ns -= round(moved.dt_s * 1e9)
            self._write_odometry_pose(moved)
            self._stamp_ns = end_ns

        self._odometry = compose(self._odometry, _arc(moved))
        self._write_odometry_pose(moved)

    def _write_odometry_pose(self, moved: Odometry) -> None:
        x_m, y_m, heading_rad = self._odometry.tolist()
        pose = self._ros.pose((x_m, y_m, 0.0), heading_rad)
        twist = self._ros.twist(moved.speed_m_s, moved.turn_rate_rad_s)
        message = self._ros.make(
            "nav_msgs/msg/Odometry",
            header=self._header(ODOM),
            child_frame_id=ROBOT,
            pose=self._ros.pose_with_covariance(pose, (0.0, 0.0, 0.0)),
            twist=self._ros.make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36)),
        )
        self._write("/odom", message)
        placed = self._transform(ODOM, ROBOT, (x_m, y_m, 0.0), turned(heading_rad))
        self._write_transforms("/tf", placed)

    def _write_command(self, command: MotorCommand) -> None:
        left_m_s = command.left_wheel_rad_s * WHEEL_RADIUS_M
        right_m_s = command.right_wheel_rad_s * WHEEL_RADIUS_M
        twist = self._ros.twist((left_m_s + right_m_s) / 2, (right_m_s - left_m_s) / TRACK_M)
        message = self._ros.make("geometry_msgs/msg/TwistStamped", self._header(ROBOT), twist)
        self._write("/cmd_vel", message)

    def _write_pose(self, agent: Self) -> None:
        pose = self._ros.pose((agent.x_m, agent.y_m, 0.0), agent.heading_rad)
        sds = (agent.x_sd_m, agent.y_sd_m, agent.heading_sd_rad)
        message = self._ros.make(
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            self._header(MAP),
            self._ros.pose_with_covariance(pose, sds),
        )
        self._write("/pose", message)

        # The robot's frame has one parent, which is odometry's: the map corrects that frame.
        believed = np.array([agent.x_m, agent.y_m, agent.heading_rad])
        origin = compose(believed, relative(self._odometry, np.zeros(3)))
        x_m, y_m, heading_rad = origin.tolist()
        placed = self._transform(MAP, ODOM, (x_m, y_m, 0.0), turned(heading_rad))
        self._write_transforms("/tf", placed)

    def _write_sentence(self, said: Sentence) -> None:
        line = self._ros.make(
            "rcl_interfaces/msg/Log",
            stamp=self._ros.time(self._stamp_ns),
            level=self._store.types["rcl_interfaces/msg/Log"].INFO,
            name=said.name,
            msg=said.text,
            file="",
            function="",
            line=0,
        )
        self._write("/rosout", line)

    def _write_true_pose(self, true: TruePose) -> None:
        pose = true.pose
        header = self._header(TOWN)
        shown = self._ros.pose_stamped(header, pose.x_m, pose.y_m, pose.heading_rad)
        self._write("/truth", shown)

    def _write_map(self, known: Map) -> None:
        self._write("/path", self._ros.path(self._header(MAP), known.path_m))
        if known.plan_m is not None:
            self._write("/plan", self._ros.path(self._header(MAP), known.plan_m))
        self._write_objects(known.objects)
        if known.places.shape[0]:
            self._write_places(known)

    def _write_objects(self, nodes: list[Object]) -> None:
        """Write all objects, after a marker that removes those of before."""
        markers = [self._ros.no_markers(self._header(MAP))]
        for number, node in enumerate(nodes):
            place_m = (node.x_m, node.y_m)
            height_m = node.height_m or OBJECT_HEIGHT_M
            side_m = node.width_m or OBJECT_WIDTH_M
            header = self._header(MAP)
            markers.append(self._ros.box(header, number, place_m, side_m, height_m))
            text = node.name or node.label
            markers.append(self._ros.lettering(header, number, place_m, height_m, text))
        self._write("/objects", self._ros.make("visualization_msgs/msg/MarkerArray", markers))

    def _write_places(self, known: Map) -> None:
        """Write what stands at the place nodes, 0 to 100; -1 where neither that nor road is."""
        obstacle = known.places.column(PlaceColumn.OBSTACLE).T
        is_known = (obstacle > 0) | (known.places.column(PlaceColumn.ROAD).T > 0)
        percent = np.where(is_known, np.rint(100 * obstacle.clip(0, 1)), -1)
        self._write(
            "/map",
            self._ros.grid(
                self._header(MAP), percent.astype(np.int8), known.cell_m, known.corner_m
            ),
        )


def _arc(moved: Odometry) -> Floats:
    """Return where a motion leads to, (3,), if both of its speeds are even."""
    half_rad = moved.turn_rate_rad_s * moved.dt_s / 2
    chord_m = moved.speed_m_s * moved.dt_s * np.sinc(half_rad / np.pi)
    return np.array([chord_m * np.cos(half_rad), chord_m * np.sin(half_rad), 2 * half_rad])


def _library() -> Any:
    try:
        from rosbags import rosbag2
    except ImportError:
        raise UsageError(
            "this needs the library rosbags: install it by `pip install 'cogmap[bags]'`"
        ) from None
    return rosbag2
