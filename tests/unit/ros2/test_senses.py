"""What messages of a robot become, and what becomes of wrong ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mcap_ros2._dynamic import serialize_dynamic
from rosbags.typesys import Stores, get_typestore

from benchmarks.ros2 import robot
from benchmarks.ros2.peer import Fields
from cogmap.data.bags.topics import CAMERA_INFO, IMAGE, LASER_SCAN, ODOMETRY
from cogmap.errors import UsageError
from cogmap.ros2.cameras import GRACE_NS
from cogmap.ros2.graph import Chosen
from cogmap.ros2.rmw.types import Types
from cogmap.ros2.senses import Senses
from cogmap.ros2.stamps import LEAD_NS
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Odometry, Percepts, RangeScan, SelfMotion, StereoFrame

S = 10**9
DAY = 1_700_000_000 * S
SIZE = (48, 64)
LEFT, RIGHT, LEFT_INFO, RIGHT_INFO = "/l/image", "/r/image", "/l/camera_info", "/r/camera_info"
CAMERAS = Chosen((LEFT, RIGHT), (LEFT_INFO, RIGHT_INFO), "/odom")
TYPES = Types("jazzy")
STORE = get_typestore(Stores.ROS2_JAZZY)
MESSAGES = TYPES.messages


class Robot:
    """Sends messages to Senses."""

    def __init__(self, chosen: Chosen = CAMERAS, period_ns: int = S // 10) -> None:
        kinds = {LEFT: IMAGE, RIGHT: IMAGE, "/odom": ODOMETRY}
        self.senses = Senses(chosen, kinds, height_m=0.0, period_ns=period_ns)
        self._receive = {wanted.topic: wanted.receive for wanted in self.senses.wanted()}

    def send(self, topic: str, message: Any) -> list[Message]:
        return self._receive[topic](message, 0)

    def info(self, size: tuple[int, int] = SIZE, baseline_m: float = 0.5) -> None:
        for topic, aside_m in ((LEFT_INFO, 0.0), (RIGHT_INFO, baseline_m)):
            self.send(topic, made(CAMERA_INFO, robot.camera_info(DAY, aside_m, size)))

    def odometry(self, at_s: float) -> None:
        stamp_ns = DAY + round(at_s * S)
        self.send("/odom", made(ODOMETRY, robot.wheels(stamp_ns, at_s)))

    def pair(self, at_s: float, right_s: float | None = None, **changed: Any) -> list[Message]:
        messages = []
        for topic, each_s in ((LEFT, at_s), (RIGHT, at_s if right_s is None else right_s)):
            stamp_ns = DAY + round(each_s * S)
            pixels = np.full(SIZE, 7, np.uint8)
            fields = robot.image(stamp_ns, pixels) | changed
            messages += self.send(topic, made(IMAGE, fields))
        return messages


def made(kind: str, fields: Fields) -> Any:
    """A message of a type, by the names of its fields, as another library writes it."""
    definition, _ = STORE.generate_msgdef(kind, ros_version=2)
    content = serialize_dynamic(kind, definition)[kind](fields)
    return TYPES.decoded(content, kind)


def test_a_pair_becomes_a_frame_after_the_motion_that_led_to_it() -> None:
    sensed = Robot()
    sensed.info()
    sensed.odometry(0.0)
    (first,) = sensed.pair(0.0)
    sensed.odometry(0.2)
    moved, second = sensed.pair(0.2)

    assert isinstance(first, StereoFrame)
    assert first.stamp_ns == LEAD_NS
    assert first.left.numpy().tolist() == np.full(SIZE, 7).tolist()
    assert first.calibration.baseline_m == pytest.approx(0.5)
    assert first.calibration.mount_height_m == 1.0
    assert isinstance(moved, Odometry)
    assert (moved.stamp_ns, moved.dt_s) == (LEAD_NS + S // 5, 0.2)
    assert moved.speed_m_s == pytest.approx(1.0)
    assert isinstance(second, StereoFrame)
    assert (second.frame, second.stamp_ns) == (1, moved.stamp_ns)


def test_pairs_within_a_period_are_left_out() -> None:
    sensed = Robot(period_ns=S // 2)
    sensed.info()
    for at_s in (0.0, 0.1, 0.4, 0.5):
        sensed.odometry(at_s)

    assert [len(sensed.pair(at_s)) > 0 for at_s in (0.0, 0.1, 0.4, 0.5)] == [1, 0, 0, 1]


def test_stamps_of_a_pair_may_differ_by_some_milliseconds() -> None:
    sensed = Robot()
    sensed.info()
    sensed.odometry(0.0)

    assert len(sensed.pair(0.0, right_s=0.004)) == 1


def test_an_image_that_waits_in_vain_for_the_other_is_named() -> None:
    sensed = Robot()
    sensed.info()
    with pytest.raises(UsageError, match=f"an image of {LEFT} has no other one within 5 ms"):
        for number in range(9):
            sensed.pair(number / 10, right_s=number / 10 + 0.05)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"encoding": "yuv422"}, f"an image of {LEFT} has the encoding 'yuv422'"),
        ({"data": bytes(9)}, f"an image of {LEFT} cannot be decoded: 9 bytes"),
        ({"height": 24}, f"an image of {LEFT} is 64 x 24, its CameraInfo says 64 x 48"),
    ],
)
def test_images_that_cannot_be_used_are_named(changed: Fields, sentence: str) -> None:
    sensed = Robot()
    sensed.info()
    sensed.odometry(0.0)

    with pytest.raises(UsageError, match=sentence):
        sensed.pair(0.0, **changed)


def test_cameras_that_were_not_calibrated_together_are_named() -> None:
    sensed = Robot()
    sensed.info(baseline_m=0.0)
    sensed.odometry(0.0)

    with pytest.raises(UsageError, match="does not stand to the right of the left one"):
        sensed.pair(0.0)


def test_a_calibration_may_come_some_seconds_late_but_not_be_missing() -> None:
    sensed = Robot()
    sensed.odometry(0.0)
    assert sensed.pair(0.0) == []

    late_s = GRACE_NS / S
    sensed.odometry(late_s)
    with pytest.raises(UsageError, match=f"nothing has come on {LEFT_INFO} and {RIGHT_INFO}"):
        sensed.pair(late_s)


def test_the_height_of_the_cameras_is_that_of_the_static_transforms() -> None:
    sensed = Robot()
    sensed.info()
    sensed.odometry(0.0)
    header = MESSAGES.header(0, "base_link")
    placed = MESSAGES.transform(header, "left_camera", (0.2, 0.0, 1.4), (-0.5, 0.5, -0.5, 0.5))
    sensed.send("/tf_static", MESSAGES.make("tf2_msgs/msg/TFMessage", [placed]))

    (frame,) = sensed.pair(0.0)
    assert isinstance(frame, StereoFrame)
    assert frame.calibration.mount_height_m == pytest.approx(1.4)
    assert frame.calibration.mount_forward_m == pytest.approx(0.2)


def test_a_scan_becomes_a_view_in_which_nothing_is_recognized() -> None:
    sensed = Robot(Chosen(odometry="/odom", scan="/scan"))
    views = []
    for at_s in (0.0, 0.2):
        sensed.odometry(at_s)
        views += sensed.send("/scan", laser(DAY + round(at_s * S)))

    motion, ranges, seen = views[3:]
    assert isinstance(motion, SelfMotion)
    assert motion.motions.numpy()[0, :3] == pytest.approx([1.0, 0.0, 0.2])
    assert isinstance(ranges, RangeScan)
    assert ranges.range_m.numpy().max() == pytest.approx(3.0)
    assert isinstance(seen, Percepts)
    assert (seen.frame, seen.objects) == (1, [])


def laser(stamp_ns: int) -> Any:
    return made(
        LASER_SCAN,
        {
            "header": robot.header(stamp_ns, "laser"),
            "angle_min": -0.5,
            "angle_max": 0.5,
            "angle_increment": 0.5,
            "time_increment": 0.0,
            "scan_time": 0.1,
            "range_min": 0.1,
            "range_max": 10.0,
            "ranges": [3.0, 3.0, 3.0],
            "intensities": [],
        },
    )


def test_a_message_without_a_stamp_is_named() -> None:
    sensed = Robot()
    with pytest.raises(UsageError, match="nav_msgs/msg/Odometry has no stamp"):
        sensed.send("/odom", made(ODOMETRY, robot.wheels(0, 0.0)))


def test_reasons_are_said_once_however_their_numbers_differ_and_all_are_counted() -> None:
    senses = Robot().senses

    assert senses.skip("an image is 0.8 s too late: mend it")
    assert not senses.skip("an image is 1.9 s too late: mend it")
    told = senses.played(0, "ros2")
    assert (told.views, told.skipped) == (0, 2)
    assert told.reasons == ["an image is 0.8 s too late: mend it"]
    assert senses.played(0, "ros2").reasons == []
