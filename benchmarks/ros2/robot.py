"""A robot that publishes a stereo pair ten times a second and odometry fifty times, and obeys."""

from __future__ import annotations

import time
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from benchmarks.ros2.peer import Fields, Peer
from cogmap.geometry.arrays import Bytes

WIDTH, HEIGHT = 320, 240
FOCAL_PX = 208.5
BASELINE_M = 0.5
DISPARITY_PX = 12
SPEED_M_S = 0.5
ODOMETRY_HZ = 50
RATE_HZ = 10
LEFT, RIGHT = "/camera/left/image_raw", "/camera/right/image_raw"
ODOMETRY = "/odom"
COMMANDS = "/cmd_vel"
IMAGE = "sensor_msgs/msg/Image"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
WHEELS = "nav_msgs/msg/Odometry"
TWIST = "geometry_msgs/msg/Twist"
COUNTED_M_S = 0.001
"""The speed that a command asks for is its number, in such steps."""


class Driven(NamedTuple):
    """When each view was published, and when each command first arrived, by number; monotonic."""

    views_ns: dict[int, int]
    commands_ns: dict[int, int]


def drive(endpoint: str, connection: Connection) -> None:
    """Drive until something comes through `connection`, then send Driven through it."""
    driven = Driven({}, {})

    def obey(twist: Any, attachment: Any) -> None:
        number = round(twist.linear.x / COUNTED_M_S)
        driven.commands_ns.setdefault(number, time.monotonic_ns())

    with Peer(endpoint) as peer:
        peer.subscribe(COMMANDS, TWIST, obey)
        cameras = [_Camera(peer, LEFT, 0.0), _Camera(peer, RIGHT, BASELINE_M)]
        odometry = peer.publisher(ODOMETRY, WHEELS)
        begin_s = time.monotonic()
        tick = 0
        while not connection.poll():
            stamp_ns = time.time_ns()
            x_m = SPEED_M_S * tick / ODOMETRY_HZ
            odometry(peer.encoded(WHEELS, wheels(stamp_ns, x_m)))
            number, rest = divmod(tick, ODOMETRY_HZ // RATE_HZ)
            if not rest:
                left, right = pair(number)
                images = [cameras[0].encoded(stamp_ns, left), cameras[1].encoded(stamp_ns, right)]
                driven.views_ns[number] = time.monotonic_ns()
                for camera, content in zip(cameras, images, strict=True):
                    camera.publish(content)
            tick += 1
            time.sleep(max(0.0, begin_s + tick / ODOMETRY_HZ - time.monotonic()))
    connection.send(driven)


class _Camera:
    """A camera with its calibration, `aside_m` to the right of the left one."""

    def __init__(self, peer: Peer, topic: str, aside_m: float) -> None:
        self.publish = peer.publisher(topic, IMAGE)
        self._peer = peer
        self._aside_m = aside_m
        self._info = peer.publisher(f"{topic.rpartition('/')[0]}/camera_info", CAMERA_INFO)

    def encoded(self, stamp_ns: int, pixels: Bytes) -> bytes:
        """Publish the calibration, and return an image that is to follow."""
        self._info(self._peer.encoded(CAMERA_INFO, camera_info(stamp_ns, self._aside_m)))
        return self._peer.encoded(IMAGE, image(stamp_ns, pixels))


def pair(number: int) -> tuple[Bytes, Bytes]:
    """Return a wall of noise, seen from both sides; the left one begins with its number."""
    wall = np.random.default_rng(number % 8).integers(0, 256, (HEIGHT, WIDTH), np.uint8)
    right = np.roll(wall, -DISPARITY_PX, axis=1)
    wall[0, :4] = np.frombuffer(number.to_bytes(4, "little"), np.uint8)
    return wall, right


def number_of(left: Bytes) -> int:
    """Return the number of a left image of `pair`."""
    return int.from_bytes(left[0, :4].tobytes(), "little")


def header(stamp_ns: int, frame: str) -> Fields:
    """Return a header."""
    sec, nanosec = divmod(stamp_ns, 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def image(stamp_ns: int, pixels: Bytes, encoding: str = "mono8") -> Fields:
    """Return a grey image."""
    height, width = pixels.shape
    return {
        "header": header(stamp_ns, "left_camera"),
        "height": height,
        "width": width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": width,
        "data": pixels.tobytes(),
    }


def camera_info(stamp_ns: int, aside_m: float, size: tuple[int, int] = (HEIGHT, WIDTH)) -> Fields:
    """Return the calibration of a rectified camera, `aside_m` to the right of the left one."""
    height, width = size
    cx_px, cy_px = (width - 1) / 2, (height - 1) / 2
    shift = -FOCAL_PX * aside_m
    return {
        "header": header(stamp_ns, "left_camera"),
        "height": height,
        "width": width,
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": [FOCAL_PX, 0.0, cx_px, 0.0, FOCAL_PX, cy_px, 0.0, 0.0, 1.0],
        "r": np.eye(3).ravel().tolist(),
        "p": [FOCAL_PX, 0.0, cx_px, shift, 0.0, FOCAL_PX, cy_px, 0.0, 0.0, 0.0, 1.0, 0.0],
        "binning_x": 0,
        "binning_y": 0,
        "roi": dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0)
        | {"do_rectify": False},
    }


def wheels(stamp_ns: int, x_m: float) -> Fields:
    """Return the odometry of a robot that drives straight ahead, and has come so far."""
    nowhere = {"x": 0.0, "y": 0.0, "z": 0.0}
    pose = {"position": nowhere | {"x": x_m}, "orientation": nowhere | {"w": 1.0}}
    twist = {"linear": nowhere | {"x": SPEED_M_S}, "angular": nowhere}
    unknown = [0.0] * 36
    return {
        "header": header(stamp_ns, "odom"),
        "child_frame_id": "base_link",
        "pose": {"pose": pose, "covariance": unknown},
        "twist": {"twist": twist, "covariance": unknown},
    }
