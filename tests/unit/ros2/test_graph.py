"""Which topics of a robot are its senses."""

from __future__ import annotations

import pytest

from cogmap.data.bags.topics import CAMERA_INFO, IMAGE, LASER_SCAN, ODOMETRY, Topics
from cogmap.errors import UsageError
from cogmap.ros2.graph import Chosen, RosGraph, chosen
from cogmap.ros2.rmw.keys import End, Seen, Stream

CAMERAS = {
    "/left/image_raw": IMAGE,
    "/left/camera_info": CAMERA_INFO,
    "/right/image_raw": IMAGE,
    "/right/camera_info": CAMERA_INFO,
}
NONE = Topics()


def graph(publishers: dict[str, str]) -> RosGraph:
    made = RosGraph()
    for topic, kind in publishers.items():
        made.update(Seen(topic, "robot", End.PUBLISHER, Stream(topic, kind, "RIHS01_0")), True)
    return made


def test_a_pair_is_found_with_its_calibrations_and_the_odometry() -> None:
    found = chosen(graph(CAMERAS | {"/odom": ODOMETRY}), NONE, ODOMETRY)

    assert found == Chosen(
        ("/left/image_raw", "/right/image_raw"),
        ("/left/camera_info", "/right/camera_info"),
        "/odom",
    )


def test_a_laser_is_found_where_there_are_no_cameras() -> None:
    found = chosen(graph({"/scan": LASER_SCAN, "/odom": ODOMETRY}), NONE, ODOMETRY)

    assert found == Chosen(odometry="/odom", scan="/scan")


def test_who_has_gone_publishes_nothing() -> None:
    made = graph({"/odom": ODOMETRY})
    made.update(Seen("/odom", "robot", End.PUBLISHER, Stream("/odom", ODOMETRY, "")), False)

    assert made.topics == {}


def test_subscriptions_are_no_topics_of_senses() -> None:
    made = RosGraph()
    wish = Seen("t", "base", End.SUBSCRIPTION, Stream("/cmd_vel", "geometry_msgs/msg/Twist", ""))
    made.update(wish, True)

    assert made.topics == {}
    assert made.subscribed("/cmd_vel") == [wish]


@pytest.mark.parametrize(
    ("publishers", "given", "sentence"),
    [
        (
            {},
            NONE,
            r"the robot publishes no nav_msgs/msg/Odometry; it has nothing: .*--no-odometry",
        ),
        ({"/odom": ODOMETRY}, NONE, "no pair of topics of images, left and right; it has /odom"),
        (
            {"/odom": ODOMETRY, "/left/image_raw": IMAGE, "/right/image_raw": IMAGE},
            NONE,
            "has no /left/camera_info",
        ),
        (
            CAMERAS | {"/odom": ODOMETRY, "/wheels": ODOMETRY},
            NONE,
            "several topics of nav_msgs/msg/Odometry.*: name one by --odometry-topic TOPIC",
        ),
        (
            CAMERAS | {"/odom": ODOMETRY},
            Topics(left="/nose/image"),
            "has no topic /nose/image .*: name the images by --left-topic TOPIC --right-topic",
        ),
        (
            {"/odom": ODOMETRY, "/cam0/image_raw": IMAGE, "/cam0/camera_info": CAMERA_INFO},
            NONE,
            "no two topics of images that differ in left and right",
        ),
    ],
)
def test_what_is_missing_is_named_with_what_there_is_and_the_remedy(
    publishers: dict[str, str], given: Topics, sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        chosen(graph(publishers), given, ODOMETRY)


def test_scans_without_odometry_are_refused() -> None:
    with pytest.raises(UsageError, match="has laser scans, and no odometry"):
        chosen(graph({"/scan": LASER_SCAN}), NONE, "")
