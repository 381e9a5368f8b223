"""The bridge as a process: the sessions, and the modules on them."""

from __future__ import annotations

from contextlib import ExitStack
from typing import NamedTuple

from cogmap.bus.access.subjects import ROS2
from cogmap.bus.session import open_client
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.ros2.bridge import Bridge, Options, Saying
from cogmap.ros2.rmw.node import RosNode
from cogmap.ros2.rmw.types import Types
from cogmap.ros2.showing import Showing
from cogmap.runtime import environment
from cogmap.runtime.client import Client
from cogmap.runtime.process import IDLE_S, Stop
from cogmap.runtime.shell import Shell

NODE = "cogmap"
START_ROUTER = (
    "start one with `ros2 run rmw_zenoh_cpp rmw_zenohd`, or name its endpoint with --ros-connect"
)


class Place(NamedTuple):
    """Where a robot is, and for whom: the router of ROS 2, the domain and the distribution; our
    router, and the agent. `with_transforms` is whether the map's frame is placed there.
    """

    ros_connect: str
    domain: int
    distro: str
    connect: str
    agent: str
    with_transforms: bool


def run_bridge(place: Place, options: Options, stop: Stop) -> None:
    """Run the bridge until `stop` is asked. Raises NoRouterError if a router does not answer, and
    UsageError if a library is missing.

    What the agent knows is shown by a thread of its own: a large map takes longer than an image may
    wait.
    """
    types = Types(place.distro)
    with ExitStack() as closing:
        session = open_client(
            place.ros_connect, is_asked_to_end=lambda: stop.asked, remedy=START_ROUTER
        )
        node = RosNode(session, place.domain, options.namespace, NODE, types)
        closing.callback(node.close)

        bridge = Bridge(node, options)
        bus = ZenohBus(place.connect, place.agent, lambda: stop.asked, environment.keys(ROS2))
        shell = Shell(bridge.module(), bus)
        closing.callback(shell.close)
        saying = Saying(node, options, place.with_transforms)
        showing = Showing(types.messages, saying.say, lambda: bridge.senses)
        closing.enter_context(Client(showing.module(), place.connect, place.agent, (ROS2,)))

        shell.open()
        bridge.open(shell.call)
        closing.callback(bridge.stop)
        while not stop.asked:
            shell.spin_once(IDLE_S)
