"""`cogmap ros2`: a robot that runs ROS 2, in the place of the module `sim`."""

from __future__ import annotations

import re

import click

from cogmap.bus.access.subjects import ROS2
from cogmap.bus.discovery import Role
from cogmap.cli.options import FiniteRange
from cogmap.cli.topic.observing import inspect_system
from cogmap.data.bags.topics import Topics
from cogmap.errors import UsageError
from cogmap.ros2.bridge import Options
from cogmap.ros2.encoders import WheelJoints
from cogmap.ros2.process import Place, run_bridge
from cogmap.ros2.rmw.keys import MAX_DOMAIN
from cogmap.ros2.rmw.types import DISTROS, NEWEST
from cogmap.ros2.steering import Limits
from cogmap.runtime import environment
from cogmap.runtime.process import Stop
from cogmap.runtime.program import agent_option, connect_option, tied_option
from cogmap.schemas import topics

NAMESPACE = re.compile(r"(/[A-Za-z_]\w*)*/?")
REMAPPED = re.compile(r"/?([\w/]+):=(/?[A-Za-z_][\w/]*)")

_EPILOG = """\b
Examples:
  RMW_IMPLEMENTATION=rmw_zenoh_cpp ros2 launch ...        on the robot, with rmw_zenohd
  cogmap run --without sim --router tcp/robot:7447 --explore 300
  cogmap ros2 --connect tcp/robot:7447 --max-speed 0.4 --max-turn 0.8
  cogmap ros2 --watch-only --left-topic /left/image_rect --right-topic /right/image_rect
  cogmap ros2 --namespace /robot1 --remap cmd_vel:=base/cmd_vel --remap map:=cogmap/map

docs/robots.md leads through it.
"""


def _namespace(context: click.Context, option: click.Parameter, name: str) -> str:
    if not NAMESPACE.fullmatch(name):
        raise UsageError(f"--namespace {name!r}: write it as /robot1, or / for none")
    return name


def _remapped(
    context: click.Context, option: click.Parameter, given: tuple[str, ...]
) -> dict[str, str]:
    names = {}
    for each in given:
        match = REMAPPED.fullmatch(each)
        if match is None:
            raise UsageError(f"--remap {each!r}: write it as ROS does, cmd_vel:=base/cmd_vel")
        names[match[1]] = match[2]
    return names


def _joints(
    context: click.Context, option: click.Parameter, given: str | None
) -> tuple[str, str] | None:
    if given is None:
        return None
    left, comma, right = given.partition(",")
    if not (left and comma and right):
        raise UsageError(
            f"--wheel-joints {given!r}: write it as left_wheel_joint,right_wheel_joint"
        )
    return left, right


def _wheels(
    joints: tuple[str, str] | None, radius_m: float | None, track_m: float | None
) -> WheelJoints | None:
    """Return what is given of the wheels. Raises UsageError if that is a part only."""
    if joints is None and radius_m is None and track_m is None:
        return None
    if joints is None or radius_m is None or track_m is None:
        raise UsageError(
            "--wheel-joints, --wheel-radius and --wheel-track belong together: give all three"
        )
    return WheelJoints(*joints, radius_m, track_m)


@click.command(epilog=_EPILOG)
@click.option(
    "--ros-connect",
    metavar="ENDPOINT",
    help="Where the router of ROS 2 listens, rmw_zenohd.  [default: that of --connect]",
)
@click.option(
    "--domain",
    type=click.IntRange(0, MAX_DOMAIN),
    default=0,
    show_default=True,
    envvar="ROS_DOMAIN_ID",
    help="The robot's ROS_DOMAIN_ID.",
)
@click.option(
    "--distro",
    type=click.Choice(DISTROS),
    default=NEWEST,
    show_default=True,
    help="The robot's distribution of ROS 2.",
)
@click.option(
    "--namespace",
    callback=_namespace,
    default="/",
    show_default=True,
    help="The namespace of our topics.",
)
@click.option(
    "--remap",
    "names",
    multiple=True,
    callback=_remapped,
    metavar="NAME:=NAME",
    help="Another name for one of our topics: cmd_vel, pose, path, plan, objects, map, tf; may be "
    "repeated.",
)
@click.option("--left-topic", default="", help="Images of the left camera.  [default: found]")
@click.option("--right-topic", default="", help="The same of the right camera.")
@click.option("--odometry-topic", default="", help="Odometry.  [default: the only one]")
@click.option("--scan-topic", default="", help="Scans of a laser, where there are no cameras.")
@click.option(
    "--no-odometry",
    is_flag=True,
    help="Use none: start with `cogmap run --set sensory.self_motion=views`.",
)
@click.option(
    "--wheel-joints",
    callback=_joints,
    metavar="LEFT,RIGHT",
    help="The joints of the wheels, whose turns joint_states tells; in the place of odometry.",
)
@click.option(
    "--wheel-radius",
    "radius_m",
    type=FiniteRange(0, 5, min_open=True),
    help="Radius of these wheels, in m.",
)
@click.option(
    "--wheel-track",
    "track_m",
    type=FiniteRange(0, 10, min_open=True),
    help="Distance between these wheels, in m.",
)
@click.option(
    "--mount-height",
    "mount_height_m",
    type=FiniteRange(0, 100),
    default=0.0,
    help="Height of the cameras above the ground, in m.  [default: by /tf_static, or 1]",
)
@click.option(
    "--rate",
    "rate_hz",
    type=FiniteRange(0.1, 100),
    default=5.0,
    show_default=True,
    help="Most views a second; the town's robot has five.",
)
@click.option(
    "--max-speed",
    "speed_m_s",
    type=FiniteRange(0, 50, min_open=True),
    default=0.5,
    show_default=True,
    help="Greatest speed that is asked for, in m/s.",
)
@click.option(
    "--max-turn",
    "turn_rate_rad_s",
    type=FiniteRange(0, 50, min_open=True),
    default=1.0,
    show_default=True,
    help="Greatest turn rate, in rad/s.",
)
@click.option(
    "--hold",
    "hold_s",
    type=FiniteRange(0.05, 5),
    default=1.0,
    show_default=True,
    help="Seconds after a command in which the robot is stopped if none follows.",
)
@click.option("--watch-only", is_flag=True, help="Let the robot drive as it does: no cmd_vel.")
@click.option("--no-tf", is_flag=True, help="Leave the transform from map to odom to others.")
@tied_option
@connect_option
@agent_option
def ros2(
    ros_connect: str | None,
    domain: int,
    distro: str,
    namespace: str,
    names: dict[str, str],
    left_topic: str,
    right_topic: str,
    odometry_topic: str,
    scan_topic: str,
    no_odometry: bool,
    wheel_joints: tuple[str, str] | None,
    radius_m: float | None,
    track_m: float | None,
    mount_height_m: float,
    rate_hz: float,
    speed_m_s: float,
    turn_rate_rad_s: float,
    hold_s: float,
    watch_only: bool,
    no_tf: bool,
    tied: bool,
    connect: str,
    agent: str,
) -> None:
    """Let a robot that runs ROS 2 take the place of the simulation.

    It speaks on Zenoh as ROS 2 does with RMW_IMPLEMENTATION=rmw_zenoh_cpp; nothing of ours runs on
    the robot. Start the modules by `cogmap run --without sim`.

    In: images of two cameras with their camera_info, or a laser's scans; odometry; tf_static. Out:
    cmd_vel, pose with covariance, path, plan, map, objects as markers, tf. The robot is stopped
    when no command has come for --hold seconds, and at the end.
    """
    if ros_connect is None and environment.keys(ROS2) is not None:
        raise UsageError(
            "with keys our router is for our modules alone: name that of ROS 2 with --ros-connect"
        )
    publishing = inspect_system(connect, agent, (ROS2,)).doing(Role.PUBLISHES, topics.STEREO)
    if publishing:
        listed = ", ".join(process.name for process in publishing)
        raise UsageError(
            f"{listed} publishes what is sensed already: start with `cogmap run --without sim`"
        )

    options = Options(
        topics=Topics(left_topic, right_topic, odometry_topic, scan_topic),
        has_odometry=not no_odometry,
        joints=_wheels(wheel_joints, radius_m, track_m),
        mount_height_m=mount_height_m,
        rate_hz=rate_hz,
        limits=None if watch_only else Limits(speed_m_s, turn_rate_rad_s, hold_s),
        namespace=namespace,
        names=names,
    )
    place = Place(ros_connect or connect, domain, distro, connect, agent, not no_tf)
    run_bridge(place, options, Stop(tied))
