"""Messages of ROS 2, made of plain numbers."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Floats, Singles
from cogmap.schemas.sensing import Calibration

Quaternion = tuple[float, float, float, float]
Position = tuple[float, float, float]
Point = tuple[float, float]

OPTICAL_AXES: Quaternion = (-0.5, 0.5, -0.5, 0.5)
"""A camera's axes are right, down and forward; the robot's forward, left and up."""

DISTORTION_MODEL = "plumb_bob"
BOX_COLOUR = (0.79, 0.54, 0.07, 0.5)
TEXT_COLOUR = (0.2, 0.2, 0.2, 1.0)
TEXT_M = 1.0
"""How high letters are, and how far above what they name."""


def turned(heading_rad: float) -> Quaternion:
    """Return a turn in the plane as x, y, z and w."""
    half_rad = heading_rad / 2
    return 0.0, 0.0, math.sin(half_rad), math.cos(half_rad)


def latched() -> Any:
    """Return the quality of service by which late subscribers get the last message, too."""
    from rosbags import interfaces as ros

    never = ros.QosTime(2147483647, 4294967295)
    return ros.Qos(
        history=ros.QosHistory.KEEP_LAST,
        depth=1,
        reliability=ros.QosReliability.RELIABLE,
        durability=ros.QosDurability.TRANSIENT_LOCAL,
        deadline=never,
        lifespan=never,
        liveliness=ros.QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=never,
        avoid_ros_namespace_conventions=False,
    )


class RosMessages:
    """Makes messages by the classes of `store`, a type store of rosbags."""

    def __init__(self, store: Any) -> None:
        self._store = store

    def make(self, kind: str, *values: Any, **fields: Any) -> Any:
        """Make a message of a type, such as `nav_msgs/msg/Path`, of all its fields."""
        return self._store.types[kind](*values, **fields)

    def time(self, stamp_ns: int) -> Any:
        """Make a time."""
        return self.make("builtin_interfaces/msg/Time", *divmod(stamp_ns, 10**9))

    def line(self, stamp_ns: int, name: str, text: str) -> Any:
        """Make a line of the log of `name`."""
        return self.make(
            "rcl_interfaces/msg/Log",
            stamp=self.time(stamp_ns),
            level=self._store.types["rcl_interfaces/msg/Log"].INFO,
            name=name,
            msg=text,
            file="",
            function="",
            line=0,
        )

    def header(self, stamp_ns: int, frame: str) -> Any:
        """Make a header."""
        return self.make("std_msgs/msg/Header", self.time(stamp_ns), frame)

    def vector(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
        """Make a vector."""
        return self.make("geometry_msgs/msg/Vector3", x, y, z)

    def pose(self, position_m: Position, heading_rad: float = 0.0) -> Any:
        """Make a pose."""
        point = self.make("geometry_msgs/msg/Point", *position_m)
        return self.make("geometry_msgs/msg/Pose", point, self._quaternion(turned(heading_rad)))

    def pose_stamped(self, header: Any, x_m: float, y_m: float, heading_rad: float = 0.0) -> Any:
        """Make a pose with a header."""
        pose = self.pose((x_m, y_m, 0.0), heading_rad)
        return self.make("geometry_msgs/msg/PoseStamped", header, pose)

    def pose_with_covariance(self, pose: Any, sds: tuple[float, float, float]) -> Any:
        """Make a pose whose x, y and heading have such standard deviations."""
        covariance = np.zeros((6, 6))
        covariance[[0, 1, 5], [0, 1, 5]] = np.square(sds)
        return self.make("geometry_msgs/msg/PoseWithCovariance", pose, covariance.ravel())

    def twist(self, speed_m_s: float, turn_rate_rad_s: float) -> Any:
        """Make the speeds of a robot on wheels."""
        linear = self.vector(speed_m_s)
        return self.make("geometry_msgs/msg/Twist", linear, self.vector(z=turn_rate_rad_s))

    def stamped_twist(self, header: Any, speed_m_s: float, turn_rate_rad_s: float) -> Any:
        """Make the speeds of a robot on wheels, with a header."""
        twist = self.twist(speed_m_s, turn_rate_rad_s)
        return self.make("geometry_msgs/msg/TwistStamped", header, twist)

    def path(self, header: Any, points_m: Floats) -> Any:
        """Make a path of (n, 2) points."""
        poses = [self.pose_stamped(header, x_m, y_m) for x_m, y_m in points_m.tolist()]
        return self.make("nav_msgs/msg/Path", header, poses)

    def transform(self, header: Any, child: str, position_m: Position, rotation: Quaternion) -> Any:
        """Make the transform that places `child` in the frame of the header."""
        transform = self.make(
            "geometry_msgs/msg/Transform", self.vector(*position_m), self._quaternion(rotation)
        )
        return self.make("geometry_msgs/msg/TransformStamped", header, child, transform)

    def image(self, header: Any, encoding: str, pixels: npt.NDArray[np.generic]) -> Any:
        """Make an image of (h, w) or (h, w, channels) pixels, without a copy."""
        height, width = pixels.shape[:2]
        content = np.ascontiguousarray(pixels).reshape(-1).view(np.uint8)
        return self.make(
            "sensor_msgs/msg/Image",
            header=header,
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=len(content) // height,
            data=content,
        )

    def points(self, header: Any, points_m: Singles) -> Any:
        """Make a cloud of (n, 3) points."""
        kind = self._store.types["sensor_msgs/msg/PointField"].FLOAT32
        fields = [
            self.make("sensor_msgs/msg/PointField", name, 4 * number, kind, 1)
            for number, name in enumerate("xyz")
        ]
        content = points_m.astype("<f4", copy=False).reshape(-1).view(np.uint8)
        return self.make(
            "sensor_msgs/msg/PointCloud2",
            header=header,
            height=1,
            width=len(points_m),
            fields=fields,
            is_bigendian=False,
            point_step=12,
            row_step=len(content),
            data=content,
            is_dense=True,
        )

    def grid(
        self, header: Any, percent: npt.NDArray[np.int8], cell_m: float, corner_m: Point
    ) -> Any:
        """Make an occupancy grid (h, w), whose first cell has that outer corner."""
        height, width = percent.shape
        pose = self.pose((*corner_m, 0.0))
        about = self.make("nav_msgs/msg/MapMetaData", header.stamp, cell_m, width, height, pose)
        return self.make("nav_msgs/msg/OccupancyGrid", header, about, percent.ravel())

    def no_markers(self, header: Any) -> Any:
        """Make the marker that removes all markers of before."""
        return self._marker(header, "", 0, action=self._kinds.DELETEALL)

    def box(self, header: Any, number: int, place_m: Point, side_m: float, height_m: float) -> Any:
        """Make a box that stands on the ground."""
        return self._marker(
            header,
            "objects",
            number,
            type=self._kinds.CUBE,
            pose=self.pose((*place_m, height_m / 2)),
            scale=self.vector(side_m, side_m, height_m),
            color=self.make("std_msgs/msg/ColorRGBA", *BOX_COLOUR),
        )

    def lettering(
        self, header: Any, number: int, place_m: Point, height_m: float, text: str
    ) -> Any:
        """Make a text above what is so high."""
        return self._marker(
            header,
            "names",
            number,
            type=self._kinds.TEXT_VIEW_FACING,
            pose=self.pose((*place_m, height_m + TEXT_M)),
            scale=self.vector(z=TEXT_M),
            color=self.make("std_msgs/msg/ColorRGBA", *TEXT_COLOUR),
            text=text,
        )

    @property
    def _kinds(self) -> Any:
        return self._store.types["visualization_msgs/msg/Marker"]

    def _marker(self, header: Any, group: str, number: int, **given: Any) -> Any:
        """Make a marker, with nothing in what is not given."""
        none = np.zeros(0, np.uint8)
        nowhere = self.header(0, "")
        fields = {
            "header": header,
            "ns": group,
            "id": number,
            "type": self._kinds.CUBE,
            "action": self._kinds.ADD,
            "pose": self.pose((0.0, 0.0, 0.0)),
            "scale": self.vector(),
            "color": self.make("std_msgs/msg/ColorRGBA", 0.0, 0.0, 0.0, 0.0),
            "lifetime": self.make("builtin_interfaces/msg/Duration", 0, 0),
            "frame_locked": False,
            "points": [],
            "colors": [],
            "texture_resource": "",
            "texture": self.make("sensor_msgs/msg/CompressedImage", nowhere, "", none),
            "uv_coordinates": [],
            "text": "",
            "mesh_resource": "",
            "mesh_file": self.make("visualization_msgs/msg/MeshFile", "", none),
            "mesh_use_embedded_materials": False,
        }
        return self.make("visualization_msgs/msg/Marker", **(fields | given))

    def left_camera(self, header: Any, camera: Calibration) -> Any:
        """Make the description of the left camera, which keeps its orientation."""
        return self._camera(header, camera, camera.left_distortion, np.eye(3), 0.0)

    def right_camera(self, header: Any, camera: Calibration) -> Any:
        """Make the description of the right camera, turned so that it is parallel to the left."""
        rotation, _ = cv2.Rodrigues(np.array(camera.right_rotation_rad))
        shift = -camera.fx_px * camera.baseline_m
        return self._camera(header, camera, camera.right_distortion, np.asarray(rotation), shift)

    def _camera(
        self,
        header: Any,
        camera: Calibration,
        distortion: tuple[float, ...],
        rotation: npt.NDArray[np.generic],
        shift: float,
    ) -> Any:
        matrix = np.array(
            [[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]]
        )
        projection = np.column_stack([matrix, [shift, 0, 0]])
        return self.make(
            "sensor_msgs/msg/CameraInfo",
            header=header,
            height=camera.height_px,
            width=camera.width_px,
            distortion_model=DISTORTION_MODEL,
            d=np.array(distortion),
            k=matrix.ravel(),
            r=rotation.astype(np.float64).ravel(),
            p=projection.ravel(),
            binning_x=0,
            binning_y=0,
            roi=self.make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, do_rectify=False),
        )

    def _quaternion(self, rotation: Quaternion) -> Any:
        return self.make("geometry_msgs/msg/Quaternion", *rotation)
