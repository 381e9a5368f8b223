"""What `cogmap ros2` takes, and what it refuses before it connects."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from cogmap.cli.main import cogmap
from cogmap.cli.ros2 import _remapped, _wheels
from cogmap.data.bags.topics import Topics
from cogmap.errors import UsageError
from cogmap.ros2.bridge import Options
from cogmap.ros2.encoders import WheelJoints

CONTEXT = click.Context(click.Command("ros2"))
OPTION = click.Option(["--remap"])


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--namespace", "robot 1"), "--namespace 'robot 1': write it as /robot1"),
        (("--remap", "cmd_vel=base"), "--remap 'cmd_vel=base': write it as ROS does"),
        (("--wheel-joints", "left"), "write it as left_wheel_joint,right_wheel_joint"),
    ],
)
def test_options_that_are_wrong_are_named_with_an_example(
    words: tuple[str, ...], sentence: str
) -> None:
    with pytest.raises(UsageError, match=sentence):
        CliRunner().invoke(cogmap, ["ros2", *words], standalone_mode=False, catch_exceptions=False)


def test_what_is_known_of_wheels_is_known_in_whole() -> None:
    assert _wheels(None, None, None) is None
    assert _wheels(("l", "r"), 0.1, 0.5) == WheelJoints("l", "r", 0.1, 0.5)
    with pytest.raises(UsageError, match="belong together"):
        _wheels(("l", "r"), 0.1, None)


@pytest.mark.parametrize(
    ("namespace", "remapped", "topic", "name"),
    [
        ("/", (), "/cmd_vel", "/cmd_vel"),
        ("/robot1", (), "/cmd_vel", "/robot1/cmd_vel"),
        ("/robot1", ("cmd_vel:=base/cmd_vel",), "/cmd_vel", "/robot1/base/cmd_vel"),
        ("/robot1", ("/map:=/shared/map",), "/map", "/shared/map"),
        ("/robot1", (), "/tf", "/tf"),
        ("/robot1", ("tf:=tf",), "/tf", "/robot1/tf"),
    ],
)
def test_our_topics_are_in_the_namespace_but_for_tf_and_may_have_other_names(
    namespace: str, remapped: tuple[str, ...], topic: str, name: str
) -> None:
    options = Options(
        topics=Topics(),
        has_odometry=True,
        joints=None,
        mount_height_m=0.0,
        rate_hz=10.0,
        limits=None,
        namespace=namespace,
        names=_remapped(CONTEXT, OPTION, remapped),
    )

    assert options.name_of(topic) == name
