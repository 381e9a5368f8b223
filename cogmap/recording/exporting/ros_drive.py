"""Moments of a drive as messages of ROS 2, each on its topic."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import arc, compose, relative
from cogmap.recording.exporting.moments import (
    OBJECT_HEIGHT_M,
    OBJECT_WIDTH_M,
    Map,
    Sentence,
    points_of,
)
from cogmap.recording.exporting.ros_messages import (
    OPTICAL_AXES,
    Position,
    Quaternion,
    RosMessages,
    turned,
)
from cogmap.recording.views import depth
from cogmap.robot import TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.array import Array
from cogmap.schemas.nodes import Need, Object, PlaceColumn, Self
from cogmap.schemas.sensing import (
    MotorCommand,
    Odometry,
    RangeScan,
    StereoFrame,
    TruePose,
    View,
)

LEFT = "left_camera_optical_frame"
RIGHT = "right_camera_optical_frame"
TOWN = "town"
"""Names of frames, by REP 103 and 105 where these have one."""

POSE = "/pose"
PATH = "/path"
PLAN = "/plan"
OBJECTS = "/objects"
MAP_TOPIC = "/map"
COMMANDS = "/cmd_vel"
TRANSFORMS = "/tf"
STATIC_TRANSFORMS = "/tf_static"

LATCHED = (STATIC_TRANSFORMS, MAP_TOPIC)
"""Who subscribes late gets the last message, too."""


class Frames(NamedTuple):
    """The names of the frames of the map, of the odometry and of the robot."""

    map: str = "map"
    odometry: str = "odom"
    robot: str = "base_link"


FRAMES = Frames()

Shown = tuple[str, Any]
"""A message of ROS, and the topic that it is for."""


def speeds_of(command: MotorCommand) -> tuple[float, float]:
    """Return the speed ahead, in m/s, and the turn rate, in rad/s, that a command asks for."""
    left_m_s = command.left_wheel_rad_s * WHEEL_RADIUS_M
    right_m_s = command.right_wheel_rad_s * WHEEL_RADIUS_M
    return (left_m_s + right_m_s) / 2, (right_m_s - left_m_s) / TRACK_M


class RosDrive:
    """Turns the moments of a drive into messages of ROS, made by `ros`.

    `odometry` is the pose of the robot in the frame of the odometry, (3,): motions that are shown
    add up to it; who knows it otherwise sets it, and `frames`.
    """

    def __init__(self, ros: RosMessages, frames: Frames = FRAMES) -> None:
        self.odometry: Floats = np.zeros(3)
        self._ros = ros
        self.frames = frames
        self._stamp_ns = 0
        self._has_mount = False
        self._has_moved = False
        self._makers: dict[type, Callable[[Any], Iterator[Shown]]] = {
            StereoFrame: self._pair,
            View: self._depth,
            RangeScan: self._scan,
            Odometry: self._motion,
            MotorCommand: self._command,
            Self: self._pose,
            Need: self._need,
            Sentence: self._sentence,
            TruePose: self._true_pose,
            Map: self._map,
        }

    def shown(self, stamp_ns: int, content: Any) -> Iterator[Shown]:
        """Yield what shows the content of a Moment; its stamps are `stamp_ns`, or before that."""
        self._stamp_ns = stamp_ns
        yield from self._makers[type(content)](content)

    def _header(self, frame: str) -> Any:
        return self._ros.header(self._stamp_ns, frame)

    def _transform(self, parent: str, child: str, place_m: Position, turn: Quaternion) -> Any:
        return self._ros.transform(self._header(parent), child, place_m, turn)

    def _transforms(self, topic: str, *transforms: Any) -> Shown:
        return topic, self._ros.make("tf2_msgs/msg/TFMessage", list(transforms))

    def _pair(self, pair: StereoFrame) -> Iterator[Shown]:
        camera = pair.calibration
        if not self._has_mount:
            self._has_mount = True
            forward_m = (camera.mount_forward_m, 0.0, camera.mount_height_m)
            right = Rotation.from_rotvec(camera.right_rotation_rad).as_quat().tolist()
            aside_m = (camera.baseline_m, 0.0, 0.0)
            yield self._transforms(
                STATIC_TRANSFORMS,
                self._transform(self.frames.robot, LEFT, forward_m, OPTICAL_AXES),
                self._transform(LEFT, RIGHT, aside_m, tuple(right)),
            )

        left = self._header(LEFT)
        right = self._header(RIGHT)
        yield "/camera/left/image_raw", self._image(left, pair.left)
        yield "/camera/left/camera_info", self._ros.left_camera(left, camera)
        yield "/camera/right/image_raw", self._image(right, pair.right)
        yield "/camera/right/camera_info", self._ros.right_camera(right, camera)

    def _image(self, header: Any, image: Array) -> Any:
        encoding = "rgb8" if len(image.shape) == 3 else "mono8"
        return self._ros.image(header, encoding, image.numpy())

    def _depth(self, view: View) -> Iterator[Shown]:
        header = self._header(LEFT)
        depth_m = depth(view.depth_m, "the view's depth")
        yield "/camera/depth/image_rect", self._ros.image(header, "32FC1", depth_m)
        yield "/camera/depth/camera_info", self._ros.left_camera(header, view.calibration)

    def _scan(self, scan: RangeScan) -> Iterator[Shown]:
        yield "/scan", self._ros.points(self._header(self.frames.robot), points_of(scan))

    def _motion(self, moved: Odometry) -> Iterator[Shown]:
        """Yield the pose by odometry alone; before the first motion, that in which it began."""
        if not self._has_moved:
            self._has_moved = True
            end_ns = self._stamp_ns
            self._stamp_ns -= round(moved.dt_s * 1e9)
            yield from self._odometry_pose(moved)
            self._stamp_ns = end_ns

        self.odometry = compose(self.odometry, arc_of(moved))
        yield from self._odometry_pose(moved)

    def _odometry_pose(self, moved: Odometry) -> Iterator[Shown]:
        x_m, y_m, heading_rad = self.odometry.tolist()
        pose = self._ros.pose((x_m, y_m, 0.0), heading_rad)
        twist = self._ros.twist(moved.speed_m_s, moved.turn_rate_rad_s)
        message = self._ros.make(
            "nav_msgs/msg/Odometry",
            header=self._header(self.frames.odometry),
            child_frame_id=self.frames.robot,
            pose=self._ros.pose_with_covariance(pose, (0.0, 0.0, 0.0)),
            twist=self._ros.make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36)),
        )
        yield "/odom", message
        place_m = (x_m, y_m, 0.0)
        placed = self._transform(
            self.frames.odometry, self.frames.robot, place_m, turned(heading_rad)
        )
        yield self._transforms(TRANSFORMS, placed)

    def _command(self, command: MotorCommand) -> Iterator[Shown]:
        header = self._header(self.frames.robot)
        yield COMMANDS, self._ros.stamped_twist(header, *speeds_of(command))

    def _pose(self, agent: Self) -> Iterator[Shown]:
        pose = self._ros.pose((agent.x_m, agent.y_m, 0.0), agent.heading_rad)
        sds = (agent.x_sd_m, agent.y_sd_m, agent.heading_sd_rad)
        message = self._ros.make(
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            self._header(self.frames.map),
            self._ros.pose_with_covariance(pose, sds),
        )
        yield POSE, message

        # The robot's frame has one parent, which is odometry's: the map corrects that frame.
        believed = np.array([agent.x_m, agent.y_m, agent.heading_rad])
        origin = compose(believed, relative(self.odometry, np.zeros(3)))
        x_m, y_m, heading_rad = origin.tolist()
        place_m = (x_m, y_m, 0.0)
        placed = self._transform(
            self.frames.map, self.frames.odometry, place_m, turned(heading_rad)
        )
        yield self._transforms(TRANSFORMS, placed)

    def _need(self, need: Need) -> Iterator[Shown]:
        yield f"/needs/{need.label}", self._ros.make("std_msgs/msg/Float64", need.level)

    def _sentence(self, said: Sentence) -> Iterator[Shown]:
        yield "/rosout", self._ros.line(self._stamp_ns, said.name, said.text)

    def _true_pose(self, true: TruePose) -> Iterator[Shown]:
        pose = true.pose
        header = self._header(TOWN)
        yield "/truth", self._ros.pose_stamped(header, pose.x_m, pose.y_m, pose.heading_rad)

    def _map(self, known: Map) -> Iterator[Shown]:
        header = self._header(self.frames.map)
        yield PATH, self._ros.path(header, known.path_m)
        if known.plan_m is not None:
            yield PLAN, self._ros.path(header, known.plan_m)
        yield OBJECTS, self._objects(known.objects)
        if known.places.shape[0]:
            yield MAP_TOPIC, self._places(known)

    def _objects(self, nodes: list[Object]) -> Any:
        """Make markers of all objects, after one that removes those of before."""
        header = self._header(self.frames.map)
        markers = [self._ros.no_markers(header)]
        for number, node in enumerate(nodes):
            place_m = (node.x_m, node.y_m)
            height_m = node.height_m or OBJECT_HEIGHT_M
            side_m = node.width_m or OBJECT_WIDTH_M
            markers.append(self._ros.box(header, number, place_m, side_m, height_m))
            text = node.name or node.label
            markers.append(self._ros.lettering(header, number, place_m, height_m, text))
        return self._ros.make("visualization_msgs/msg/MarkerArray", markers)

    def _places(self, known: Map) -> Any:
        """Make the grid of what stands at the place nodes, 0 to 100; -1 where neither that nor road
        is.
        """
        obstacle = known.places.column(PlaceColumn.OBSTACLE).T
        is_known = (obstacle > 0) | (known.places.column(PlaceColumn.ROAD).T > 0)
        percent = np.where(is_known, np.rint(100 * obstacle.clip(0, 1)), -1)
        header = self._header(self.frames.map)
        return self._ros.grid(header, percent.astype(np.int8), known.cell_m, known.corner_m)


def arc_of(moved: Odometry) -> Floats:
    """Return where a motion leads to, (3,), if both of its speeds are even."""
    return arc(moved.speed_m_s * moved.dt_s, moved.turn_rate_rad_s * moved.dt_s)
