"""`cogmap ros2` as users run it: a recorded robot, which speaks by libraries of others."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zenoh
from zenoh import ext

from benchmarks.ros2 import robot
from benchmarks.ros2.peer import Peer
from cogmap.bus.session import free_endpoint, open_client, open_router
from cogmap.data.kitti import read_kitti
from cogmap.robot import WHEEL_RADIUS_M
from cogmap.ros2.rmw.attachment import decoded
from cogmap.ros2.rmw.keys import LATCHED
from cogmap.ros2.rmw.node import RosNode
from cogmap.ros2.rmw.types import Types
from cogmap.runtime.client import Client
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.sensing import MotorCommand, StereoFrame, View
from cogmap.services import registry
from tests.support.recordings import kitti_folder
from tests.support.system.processes import Process, wait_until

TWIST = "geometry_msgs/msg/Twist"
SPEED_M_S = 0.25


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Where a router listens, for ROS and for us."""
    where = free_endpoint()
    router = open_router(where)
    yield where
    router.close()


class Recorded:
    """A recorded robot that drives on a thread: its pictures anew, ten times a second."""

    def __init__(self, peer: Peer, folder: Path) -> None:
        self.pictures = read_kitti(folder)
        self.twists: list[float] = []
        self.stamped: list[Any] = []
        self._peer = peer
        self._ended = threading.Event()
        self._publishers = {
            topic: peer.publisher(topic, kind)
            for topic, kind in (
                (robot.LEFT, robot.IMAGE),
                (robot.RIGHT, robot.IMAGE),
                ("/camera/left/camera_info", robot.CAMERA_INFO),
                ("/camera/right/camera_info", robot.CAMERA_INFO),
                (robot.ODOMETRY, robot.WHEELS),
            )
        }
        peer.subscribe("/cmd_vel", TWIST, lambda twist, _: self.twists.append(twist.linear.x))
        peer.subscribe("/cmd_vel", f"{TWIST}Stamped", lambda twist, _: self.stamped.append(twist))
        self._thread = threading.Thread(target=self._drive)

    def __enter__(self) -> Recorded:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _drive(self) -> None:
        size = (48, 64)
        views = 0
        while not self._ended.wait(0.1):
            stamp_ns = time.time_ns()
            left, right = self.pictures.pair(views % len(self.pictures))
            views += 1
            self._put(robot.ODOMETRY, robot.WHEELS, robot.wheels(stamp_ns, views / 20))
            for side, topic, pixels, aside_m in (
                ("left", robot.LEFT, left, 0.0),
                ("right", robot.RIGHT, right, 0.5),
            ):
                info = robot.camera_info(stamp_ns, aside_m, size)
                self._put(f"/camera/{side}/camera_info", robot.CAMERA_INFO, info)
                self._put(topic, robot.IMAGE, robot.image(stamp_ns, pixels))

    def _put(self, topic: str, kind: str, message: dict[str, Any]) -> None:
        self._publishers[topic](self._peer.encoded(kind, message))


def test_a_robot_is_seen_through_driven_and_stopped(endpoint: str, tmp_path: Path) -> None:
    folder = kitti_folder(tmp_path / "drive")
    views: list[StereoFrame] = []
    is_driving = True

    def answer(frame: StereoFrame) -> MotorCommand | None:
        views.append(frame)
        if not is_driving:
            return None
        wheel_rad_s = SPEED_M_S / WHEEL_RADIUS_M
        return MotorCommand(
            stamp_ns=frame.stamp_ns, left_wheel_rad_s=wheel_rad_s, right_wheel_rad_s=wheel_rad_s
        )

    bridge = Process("ros2", tmp_path / "ros2.txt", "ros2", "--connect", endpoint, "--hold", "0.5")
    motor = Module("motor").on(topics.STEREO, answer, [topics.MOTOR_COMMAND])
    with Peer(endpoint) as peer, Recorded(peer, folder) as recorded, Client(motor, endpoint):
        wait_until(lambda: len(views) > 2, "views arrive")
        wait_until(lambda: SPEED_M_S in [round(each, 6) for each in recorded.twists], "it drives")
        is_driving = False
        wait_until(lambda: recorded.twists[-1] == 0.0, "it stops as no command comes")
        is_driving = True
        wait_until(lambda: recorded.twists[-1] > 0.0, "it drives on")
        assert bridge.end(signal.SIGINT) == 0
        assert recorded.twists[-1] == 0.0

        stamped = recorded.stamped[-1]
        assert (stamped.twist.linear.x, stamped.header.frame_id) == (0.0, "base_link")
        assert stamped.header.stamp.sec == pytest.approx(time.time(), abs=10)

        left, right = recorded.pictures.pair(0)
        np.testing.assert_array_equal(views[0].left.numpy(), left)
        np.testing.assert_array_equal(views[0].right.numpy(), right)
        assert views[0].calibration.baseline_m == pytest.approx(0.5)


def test_what_a_robot_sees_becomes_a_view_with_depth(endpoint: str, tmp_path: Path) -> None:
    folder = kitti_folder(tmp_path / "drive")
    views: list[View] = []
    bridge = Process("ros2", tmp_path / "ros2.txt", "ros2", "--connect", endpoint, "--watch-only")
    sensory = registry.build("sensory", {"sensory": {"self_motion": "wheels"}})
    observer = Module("observer").on(topics.VIEW, views.append)
    with (
        Peer(endpoint) as peer,
        Recorded(peer, folder) as recorded,
        Client(sensory, endpoint),
        Client(observer, endpoint),
    ):
        wait_until(lambda: len(views) > 2, "views with depth arrive")
        assert bridge.end(signal.SIGINT) == 0

    depth_m = views[-1].depth_m.numpy()
    wall_m = robot.FOCAL_PX * robot.BASELINE_M / 5  # the pictures are moved by five pixels
    assert np.median(depth_m[depth_m > 0]) == pytest.approx(wall_m, rel=0.02)
    assert recorded.twists == []


def test_what_a_robot_lacks_is_said_with_what_it_has(endpoint: str, tmp_path: Path) -> None:
    bridge = Process("ros2", tmp_path / "ros2.txt", "ros2", "--connect", endpoint)
    with Peer(endpoint) as peer:
        peer.publisher("/odom", robot.WHEELS)
        peer.publisher("/nose/image_raw", robot.IMAGE)
        wait_until(lambda: "has no" in "".join(bridge.lines()), "it says what is missing")
    assert bridge.end(signal.SIGINT) == 0

    said = "\n".join(bridge.lines())
    assert "has no pair of topics of images, left and right; it has" in said
    assert "/nose/image_raw (sensor_msgs/msg/Image)" in said
    assert "--left-topic TOPIC --right-topic TOPIC" in said


def test_no_router_of_ros_is_named_with_the_remedy(endpoint: str, tmp_path: Path) -> None:
    nowhere = free_endpoint()
    bridge = Process(
        "ros2", tmp_path / "ros2.txt", "ros2", "--connect", endpoint, "--ros-connect", nowhere
    )
    wait_until(lambda: not bridge.is_alive, "it gives up")

    assert bridge.exit_code == 2
    assert f"no router at {nowhere} within 5 s: start one with `ros2 run" in bridge.lines()[-1]


def test_a_late_subscription_gets_the_latched_map_with_its_attachment(endpoint: str) -> None:
    node = RosNode(open_client(endpoint), 0, "/", "cogmap", Types("jazzy"))
    maps = node.publisher("/map", "std_msgs/msg/String", LATCHED)
    string = node.types.messages.make("std_msgs/msg/String", "the first")
    maps.put(string)
    maps.put(node.types.messages.make("std_msgs/msg/String", "the last"))

    late: list[zenoh.Sample] = []
    session = open_client(endpoint)
    # As rmw_zenoh subscribes where a subscription is transient local.
    subscriber = ext.declare_advanced_subscriber(
        session,
        f"0/map/std_msgs::msg::dds_::String_/{node.types.hash_of('std_msgs/msg/String')}",
        late.append,
        history=ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
        recovery=ext.RecoveryConfig(heartbeat=True),
        subscriber_detection=True,
    )
    wait_until(lambda: bool(late), "the map comes")
    subscriber.undeclare()
    session.close()
    node.close()

    (sample,) = late
    assert node.types.decoded(bytes(sample.payload), "std_msgs/msg/String").data == "the last"
    assert sample.attachment is not None
    assert decoded(bytes(sample.attachment)).number == 2
