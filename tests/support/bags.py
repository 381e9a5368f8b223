"""Small bags of ROS, made in a test by the writers of rosbags."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

HEIGHT, WIDTH = 48, 64
FOCAL_PX = 55.0
BASELINE_M = 0.5
SECOND_NS = 10**9
BEGIN_NS = 1_700_000_000 * SECOND_NS
"""When the bags begin: a day of 2023."""

LEFT = "/stereo/left/image_raw"
RIGHT = "/stereo/right/image_raw"
ODOMETRY = "/odom"
SCAN = "/scan"
WALL = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH), np.uint8)


def frame_ns(number: int) -> int:
    """When frame `number` was taken: five a second, from 0.2 s on."""
    return BEGIN_NS + (number + 1) * SECOND_NS // 5


class BagMaker:
    """Writes the messages of a bag of ROS 1 or 2, to be used in a `with` statement."""

    def __init__(self, path: Path, ros: int = 2, plugin: str = "MCAP") -> None:
        self._ros = ros
        self._connections: dict[str, Any] = {}
        self._writer: Any
        if ros == 1:
            self._store = get_typestore(Stores.ROS1_NOETIC)
            self._writer = rosbag1.Writer(path)
        else:
            self._store = get_typestore(Stores.ROS2_JAZZY)
            self._writer = rosbag2.Writer(
                path, version=9, storage_plugin=rosbag2.StoragePlugin[plugin]
            )

    def __enter__(self) -> BagMaker:
        self._writer.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._writer.close()

    def write(self, topic: str, kind: str, log_ns: int, **fields: Any) -> None:
        """Write a message of a type, at the time at which it was recorded."""
        if topic not in self._connections:
            connection = self._writer.add_connection(topic, kind, typestore=self._store)
            self._connections[topic] = connection
        message = self.make(kind, **fields)
        if self._ros == 1:
            content = self._store.serialize_ros1(message, kind)
        else:
            content = self._store.serialize_cdr(message, kind)
        self._writer.write(self._connections[topic], log_ns, content)

    def make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def header(self, stamp_ns: int, frame: str = "") -> Any:
        sec, nanosec = divmod(stamp_ns, SECOND_NS)
        stamp = self.make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        seq = {"seq": 0} if self._ros == 1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **seq)

    def image(
        self,
        topic: str,
        stamp_ns: int,
        pixels: np.ndarray[Any, Any],
        *,
        encoding: str = "mono8",
        log_ns: int = 0,
        is_bigendian: int = 0,
    ) -> None:
        """Write an image of the pixels as they are."""
        content = np.ascontiguousarray(pixels).reshape(-1).view(np.uint8)
        self.write(
            topic,
            "sensor_msgs/msg/Image",
            log_ns or stamp_ns,
            header=self.header(stamp_ns),
            height=pixels.shape[0],
            width=pixels.shape[1],
            encoding=encoding,
            is_bigendian=is_bigendian,
            step=len(content) // pixels.shape[0],
            data=content,
        )

    def compressed(self, topic: str, stamp_ns: int, content: bytes) -> None:
        """Write a compressed image."""
        self.write(
            topic,
            "sensor_msgs/msg/CompressedImage",
            stamp_ns,
            header=self.header(stamp_ns),
            format="png",
            data=np.frombuffer(content, np.uint8),
        )

    def camera(
        self,
        topic: str,
        baseline_m: float = 0.0,
        size: tuple[int, int] = (HEIGHT, WIDTH),
        distortion: Sequence[float] = (0.0,) * 5,
        model: str = "plumb_bob",
    ) -> None:
        """Write what describes a camera, at the beginning of the bag."""
        matrix = np.array([[FOCAL_PX, 0, 31.5], [0, FOCAL_PX, 23.5], [0, 0, 1]])
        shift = [-FOCAL_PX * baseline_m, 0, 0]
        numbers = {
            "d": np.array(distortion, np.float64),
            "k": matrix.ravel(),
            "r": np.eye(3).ravel(),
            "p": np.column_stack([matrix, shift]).ravel(),
        }
        if self._ros == 1:
            numbers = {name.upper(): value for name, value in numbers.items()}
        roi = dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0)
        self.write(
            topic,
            "sensor_msgs/msg/CameraInfo",
            BEGIN_NS,
            header=self.header(BEGIN_NS, "left_eye"),
            height=size[0],
            width=size[1],
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=self.make("sensor_msgs/msg/RegionOfInterest", **roi, do_rectify=False),
            **numbers,
        )

    def odometry(
        self, stamp_ns: int, x_m: float, heading_rad: float = 0.0, topic: str = ODOMETRY
    ) -> None:
        """Write the pose of a robot, which says nothing of its speed."""
        half_rad = heading_rad / 2
        pose = self.pose((x_m, 0.0, 0.0), (0.0, 0.0, np.sin(half_rad), np.cos(half_rad)))
        none = self.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self.make("geometry_msgs/msg/Twist", linear=none, angular=none)
        placed = {"pose": pose, "covariance": np.zeros(36)}
        moving = {"twist": twist, "covariance": np.zeros(36)}
        self.write(
            topic,
            "nav_msgs/msg/Odometry",
            stamp_ns,
            header=self.header(stamp_ns),
            child_frame_id="base_link",
            pose=self.make("geometry_msgs/msg/PoseWithCovariance", **placed),
            twist=self.make("geometry_msgs/msg/TwistWithCovariance", **moving),
        )

    def scan(
        self, stamp_ns: int, range_m: Sequence[float], *, frame: str = "", log_ns: int = 0
    ) -> None:
        """Write the scan of a laser that turns once around, from behind to the left."""
        self.write(
            SCAN,
            "sensor_msgs/msg/LaserScan",
            log_ns or stamp_ns,
            header=self.header(stamp_ns, frame),
            angle_min=-np.pi,
            angle_max=np.pi,
            angle_increment=2 * np.pi / len(range_m),
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.1,
            range_max=10.0,
            ranges=np.array(range_m, np.float32),
            intensities=np.zeros(0, np.float32),
        )

    def pose(self, place_m: Sequence[float], turn: Sequence[float]) -> Any:
        point = self.make("geometry_msgs/msg/Point", **dict(zip("xyz", place_m, strict=True)))
        rotation = self.make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", turn, strict=True)))
        return self.make("geometry_msgs/msg/Pose", position=point, orientation=rotation)

    def static(self, parent: str, child: str, place_m: Sequence[float]) -> None:
        """Write where a frame stands in another one, turned as a camera's is in a robot's."""
        moved = self.make("geometry_msgs/msg/Vector3", **dict(zip("xyz", place_m, strict=True)))
        turn = self.make("geometry_msgs/msg/Quaternion", x=-0.5, y=0.5, z=-0.5, w=0.5)
        placed = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(BEGIN_NS, parent),
            child_frame_id=child,
            transform=self.make("geometry_msgs/msg/Transform", translation=moved, rotation=turn),
        )
        self.write("/tf_static", "tf2_msgs/msg/TFMessage", BEGIN_NS, transforms=[placed])


def pair(number: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A wall of noise, 5.5 m away, moved by a row for each frame."""
    left = np.roll(WALL, number, axis=0)
    return left, np.roll(left, -5, axis=1)


def cameras(maker: BagMaker) -> None:
    """Write what describes both cameras."""
    maker.camera("/stereo/left/camera_info")
    maker.camera("/stereo/right/camera_info", BASELINE_M)


def frames(maker: BagMaker, numbers: Sequence[int] = range(4)) -> None:
    """Write pairs of grey images."""
    for number in numbers:
        left, right = pair(number)
        maker.image(LEFT, frame_ns(number), left)
        maker.image(RIGHT, frame_ns(number), right)


def wheels(maker: BagMaker, until_s: float = 1.0) -> None:
    """Write the odometry of a robot that drives straight ahead, at 1 m/s, 20 times a second."""
    for number in range(round(20 * until_s) + 1):
        maker.odometry(BEGIN_NS + number * SECOND_NS // 20, number / 20)


def png(image: np.ndarray[Any, Any]) -> bytes:
    _, content = cv2.imencode(".png", image)
    return content.tobytes()
