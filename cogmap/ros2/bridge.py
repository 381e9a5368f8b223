"""The bridge: a module in the place of the simulation, between our bus and a node of ROS 2."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cogmap.data.bags.topics import ODOMETRY, Topics
from cogmap.errors import MessageError, UsageError
from cogmap.recording.exporting import ros_drive
from cogmap.ros2.encoders import JOINT_STATE, WheelJoints
from cogmap.ros2.graph import SETTLED_NS, Chosen, RosGraph, chosen
from cogmap.ros2.rmw.keys import LATCHED, USUAL, Seen, absolute
from cogmap.ros2.rmw.node import Publisher, RosNode, Take
from cogmap.ros2.senses import Senses, Wanted
from cogmap.ros2.steering import PERIOD_NS, Limits, Steering
from cogmap.runtime.module import Module, Reply
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand

NAME = "sim"
INSTANCE = "ros2"
TICK_NS = 50_000_000
TOLD_PERIOD_NS = 1_000_000_000
EARLY = 0.9
"""Share of the period of views after which the next one is taken: cameras are not so exact."""

TWIST = "geometry_msgs/msg/Twist"
TWIST_STAMPED = "geometry_msgs/msg/TwistStamped"
_EMITS = (
    topics.CLOCK,
    topics.STEREO,
    topics.ODOMETRY,
    topics.SELF_MOTION,
    topics.SCAN,
    topics.PERCEPTS,
    topics.PLAYBACK,
)
Call = Callable[[Callable[[], Reply]], None]
"""Have the module's thread call something, and publish what that returns."""

log = logging.getLogger("cogmap")


@dataclass(frozen=True)
class Options:
    """What a user says of a robot: the topics of its senses, empty where they are found; whether it
    has odometry, or the joints of its wheels instead; the height of its cameras, 0 where it tells
    that; how many views a second are wanted; and what may be asked of it, None if nothing. `names`
    are other names of our topics.
    """

    topics: Topics
    has_odometry: bool
    joints: WheelJoints | None
    mount_height_m: float
    rate_hz: float
    limits: Limits | None
    namespace: str
    names: dict[str, str]

    @property
    def odometry_kind(self) -> str:
        """Return the type of the messages of the wheels, empty if there are none."""
        if self.joints is not None:
            return JOINT_STATE
        return ODOMETRY if self.has_odometry else ""

    def name_of(self, topic: str) -> str:
        """Return the whole name of a topic of ours, such as `/map`; `/tf` is in no namespace."""
        renamed = self.names.get(topic.strip("/"))
        if renamed is None and topic == ros_drive.TRANSFORMS:
            return topic
        return absolute(renamed or topic.strip("/"), self.namespace)


class Bridge:
    """Publishes on our bus what a robot senses, and has the robot obey our motor commands.

    All of it runs on the thread of the module: by `call`, once it is open, what others receive.
    """

    def __init__(self, node: RosNode, options: Options) -> None:
        self.senses: Senses | None = None
        self._node = node
        self._options = options
        self._call: Call = lambda handler: None
        self._graph = RosGraph()
        self._changed_ns = time.monotonic_ns()
        self._problem = ""
        self._steering = None if options.limits is None else Steering(options.limits)
        self._commands = options.name_of(ros_drive.COMMANDS)
        self._drivers: dict[str, Publisher] = {}
        self._said_ns = 0
        self._told_ns = 0

    def module(self) -> Module:
        """Return the module that takes the place of the simulation."""
        module = Module(NAME, INSTANCE, notes=self.notes)
        module.on(topics.MOTOR_COMMAND, self.on_command, _EMITS)
        return module.every(TICK_NS, self.on_timer, _EMITS)

    def open(self, call: Call) -> None:
        """Begin to look for topics."""
        self._call = call
        self._node.watch(lambda seen, is_there: self._call(lambda: self._on_end(seen, is_there)))

    def stop(self) -> None:
        """Stop the robot, if it was asked to move."""
        if self._steering is not None and self._steering.speeds is not None:
            self._steering.halt()
            self._drive()

    def notes(self) -> list[str]:
        """Say what is wrong now."""
        notes = [self._problem] if self._problem else []
        for topic, number in self._node.gaps.missing.items():
            if number:
                notes.append(f"{number} messages on {topic} did not arrive")
        if self._steering is not None and self._steering.stops:
            notes.append(f"the robot was stopped {self._steering.stops} times: no command came")
        if self._steering is not None and not self._drivers:
            notes.append(f"nobody subscribes to {self._commands}: the robot cannot be driven")
        if self.senses is not None and self.senses.odometry is not None:
            jumps = self.senses.odometry.jumps
            if jumps:
                notes.append(f"{jumps} jumps of the odometry are left out: no wheels move so")
        return notes

    def on_command(self, command: MotorCommand) -> None:
        """Pass a motor command on. Raises MessageError if it is too old."""
        if self._steering is None or self.senses is None:
            return
        wall_ns = time.monotonic_ns()
        self._steering.on_command(command, self.senses.stamps.now_ns(wall_ns), wall_ns)
        self._drive()

    def on_timer(self, wall_ns: int) -> list[Message]:
        """Return the time, and sometimes how many views there were; repeat the last command."""
        if self._steering is not None:
            self._steering.on_timer(wall_ns)
            self._find_drivers()
            if wall_ns - self._said_ns >= PERIOD_NS:
                self._drive()

        senses = self.senses
        if senses is None:
            if wall_ns - self._changed_ns > SETTLED_NS:
                self._choose()
            return []

        messages: list[Message] = []
        if senses.stamps.has_begun:
            messages.append(Clock(stamp_ns=senses.stamps.now_ns(wall_ns)))
        if wall_ns - self._told_ns >= TOLD_PERIOD_NS:
            self._told_ns = wall_ns
            messages.append(senses.played(wall_ns, INSTANCE))
        return messages

    def _on_end(self, seen: Seen, is_there: bool) -> None:
        self._graph.update(seen, is_there)
        self._changed_ns = time.monotonic_ns()

    def _choose(self) -> None:
        """Choose topics and subscribe to them; if that cannot be done yet, say why."""
        options = self._options
        try:
            found = chosen(self._graph, options.topics, options.odometry_kind)
        except UsageError as error:
            if str(error) != self._problem:
                self._problem = str(error)
                log.warning("%s", error)
            return

        self._problem = ""
        log.info("senses: %s", ", ".join(_named(found)))
        period_ns = round(1e9 / options.rate_hz * EARLY)
        kinds = self._graph.topics
        senses = Senses(found, kinds, options.mount_height_m, period_ns, options.joints)
        self.senses = senses
        for wanted in senses.wanted():
            self._subscribe(senses, wanted)

    def _subscribe(self, senses: Senses, wanted: Wanted) -> None:
        def receive(take: Take) -> Reply:
            try:
                message = take()
                return None if message is None else wanted.receive(message, time.monotonic_ns())
            except (MessageError, UsageError) as error:
                if senses.skip(str(error)):
                    log.warning("left out: %s", error)
                return None

        self._node.subscribe(
            wanted.topic,
            wanted.kind,
            lambda take: self._call(lambda: receive(take)),
            wanted.quality,
        )

    def _find_drivers(self) -> None:
        """Announce publishers of the types in which the robot subscribes to commands."""
        for seen in self._graph.subscribed(self._commands):
            kind = seen.stream.kind
            if kind in {TWIST, TWIST_STAMPED} and kind not in self._drivers:
                self._drivers[kind] = self._node.publisher(self._commands, kind)
                log.info("commands: %s (%s)", self._commands, kind)

    def _drive(self) -> None:
        """Ask the robot for the speeds of the last command."""
        speeds = None if self._steering is None else self._steering.speeds
        if speeds is None or self.senses is None:
            return

        self._said_ns = time.monotonic_ns()
        stamps = self.senses.stamps
        robot_ns = stamps.on_robot(stamps.now_ns(self._said_ns))
        ros = self._node.types.messages
        for kind, driver in self._drivers.items():
            if kind == TWIST:
                driver.put(ros.twist(*speeds))
            else:
                header = ros.header(robot_ns, self.senses.frames.robot)
                driver.put(ros.stamped_twist(header, *speeds))


class Saying:
    """Publishes what is shown, each topic from its first message on."""

    def __init__(self, node: RosNode, options: Options, with_transforms: bool) -> None:
        self._node = node
        self._options = options
        self._with_transforms = with_transforms
        self._publishers: dict[str, Publisher] = {}

    def say(self, topic: str, message: Any) -> None:
        """Publish a message on a topic of ours."""
        if topic == ros_drive.TRANSFORMS and not self._with_transforms:
            return
        publisher = self._publishers.get(topic)
        if publisher is None:
            quality = LATCHED if topic in ros_drive.LATCHED else USUAL
            name = self._options.name_of(topic)
            publisher = self._node.publisher(name, message.__msgtype__, quality)
            self._publishers[topic] = publisher
        publisher.put(message)


def _named(found: Chosen) -> list[str]:
    """Return the topics that are not empty."""
    return [name for name in (*found.images, *found.infos, found.scan, found.odometry) if name]
