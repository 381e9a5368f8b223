"""What ROS is shown of what the agent believes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cogmap.ros2.graph import Chosen
from cogmap.ros2.rmw.types import Types
from cogmap.ros2.senses import Senses
from cogmap.ros2.showing import Showing
from cogmap.ros2.stamps import LEAD_NS
from cogmap.schemas.graph import Delta, Phase
from cogmap.schemas.nodes import Self
from cogmap.testing import agent

S = 10**9
DAY = 1_700_000_000 * S


def shown(senses: Senses | None, *agents: Self) -> list[tuple[str, Any]]:
    """What is said of these beliefs, a delta each."""
    said: list[tuple[str, Any]] = []
    showing = Showing(
        Types("jazzy").messages,
        lambda topic, message: said.append((topic, message)),
        lambda: senses,
    )
    module = showing.module()
    for version, each in enumerate(agents, start=1):
        module.feed(
            Delta(
                stamp_ns=each.stamp_ns,
                version=version,
                cycle=version,
                phase=Phase.LOCALIZATION,
                operations=[each],
            )
        )
    return said


@pytest.fixture
def senses() -> Senses:
    """The senses of a robot whose odometry has it at (1, 0), in the frame `odom`."""
    made = Senses(
        Chosen(odometry="/odom", scan="/scan"), {"/odom": "nav_msgs/msg/Odometry"}, 0.0, S
    )
    messages = Types("jazzy").messages
    pose = messages.pose((1.0, 0.0, 0.0))
    odometry = messages.make(
        "nav_msgs/msg/Odometry",
        header=messages.header(DAY, "odom"),
        child_frame_id="base_footprint",
        pose=messages.pose_with_covariance(pose, (0.0, 0.0, 0.0)),
        twist=messages.make(
            "geometry_msgs/msg/TwistWithCovariance", messages.twist(0.0, 0.0), np.zeros(36)
        ),
    )
    (receive,) = [each.receive for each in made.wanted() if each.topic == "/odom"]
    receive(odometry, 0)
    return made


def test_a_belief_is_a_pose_with_covariance_at_the_robots_time(senses: Senses) -> None:
    believed = agent(stamp_ns=LEAD_NS, x_m=3.0, y_m=2.0, x_sd_m=0.1, y_sd_m=0.2)
    pose = dict(shown(senses, believed))["/pose"]

    stamp = pose.header.stamp
    assert (pose.header.frame_id, stamp.sec * S + stamp.nanosec) == ("map", DAY)
    assert (pose.pose.pose.position.x, pose.pose.pose.position.y) == (3.0, 2.0)
    assert pose.pose.covariance[[0, 7]] == pytest.approx([0.01, 0.04])


def test_the_map_corrects_the_frame_of_the_robots_own_odometry(senses: Senses) -> None:
    (placed,) = dict(shown(senses, agent(stamp_ns=LEAD_NS, x_m=3.0, y_m=2.0)))["/tf"].transforms

    assert (placed.header.frame_id, placed.child_frame_id) == ("map", "odom")
    moved = placed.transform.translation
    assert (moved.x, moved.y) == pytest.approx((2.0, 2.0))


def test_without_odometry_the_map_places_the_robot_itself() -> None:
    alone = Senses(Chosen(("/l", "/r"), ("/li", "/ri")), {}, 0.0, S)
    (placed,) = dict(shown(alone, agent(stamp_ns=LEAD_NS, x_m=3.0, y_m=2.0)))["/tf"].transforms

    assert (placed.header.frame_id, placed.child_frame_id) == ("map", "base_link")
    assert placed.transform.translation.x == pytest.approx(3.0)


def test_all_of_the_map_is_shown_once_a_second(senses: Senses) -> None:
    beliefs = [agent(stamp_ns=LEAD_NS + number * S // 5) for number in range(8)]
    topics = [topic for topic, _ in shown(senses, *beliefs)]

    assert topics.count("/pose") == 8
    assert topics.count("/path") == topics.count("/objects") == 2


def test_nothing_is_shown_before_something_is_sensed() -> None:
    assert shown(None, agent(stamp_ns=LEAD_NS)) == []
