"""A running system as the source of a dashboard."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import msgspec

from cogmap.bus.access.subjects import ACTS_OR_READS
from cogmap.bus.codec import Envelope, encode
from cogmap.bus.interface import Arrival, Member
from cogmap.bus.zenoh_bus import ZenohBus
from cogmap.cli.dashboard.driving import Driving
from cogmap.cli.dashboard.received import Arrived
from cogmap.cli.dashboard.scene import FOLLOWED, Scene
from cogmap.cli.dashboard.source import Playing, Wish
from cogmap.cli.dashboard.workers import Workers
from cogmap.cli.param import ANSWER_S, settings_of
from cogmap.errors import AccessError, NoAnswerError, NoRouterError, UsageError
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import called
from cogmap.graph.replica import Fetched, Replica, snapshot_over
from cogmap.hints import did_you_mean
from cogmap.runtime import config, environment
from cogmap.runtime.config import Sections
from cogmap.runtime.delivery.inbox import Inbox
from cogmap.runtime.delivery.intake import Intake
from cogmap.runtime.delivery.plausibility import Plausibility
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode, SnapshotRequest
from cogmap.schemas.nodes import Goal, Object, goal_id
from cogmap.schemas.process import Pause
from cogmap.schemas.sensing import Reset, StreetClosure
from cogmap.schemas.topics import Topic
from cogmap.services.codelets.public import PlanningConfig
from cogmap.services.global_workspace.config import Config

log = logging.getLogger("cogmap")
DASHBOARD = "dashboard"
IDLE_S = 0.1
RETRY_S = 1.0
ACCESS_RETRY_S = 10.0
PUBLISHED = (topics.OFFER, topics.STREET_CLOSURE, topics.PAUSE, topics.RESET)


class Live:
    """The system at `endpoint`. It is on the bus only while a browser watches, and costs nothing
    else.
    """

    def __init__(self, endpoint: str, agent: str) -> None:
        self.label = f"{agent} at {endpoint}"
        self.lock = threading.Lock()
        self._endpoint = endpoint
        self._agent = agent
        self._is_wanted = threading.Event()
        self._has_ended = threading.Event()
        self._connection: Connection | None = None
        self._driving = Driving(endpoint, agent)
        self._workers = Workers(endpoint, agent)
        self.scene = self._scene(Replica(_nowhere), {})
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    @property
    def is_there(self) -> bool:
        """Return whether the bus is joined."""
        return self._connection is not None

    @property
    def playing(self) -> Playing | None:
        """Return None: it is no log."""
        return None

    def watched(self, by: int) -> None:
        """Join the bus for the first browser, leave it after the last."""
        if by:
            self._is_wanted.set()
        else:
            self._is_wanted.clear()
            self._driving.leave()

    def act(self, wish: Wish) -> str:
        """Do what a person wishes. Raises UsageError if it is not for a running system."""
        connection = self._connection
        if connection is None:
            raise UsageError(f"nothing runs at {self._endpoint}: start it with `cogmap run`")
        if wish.key is not None:
            return self._driving.press(wish.key)
        if wish.adds_worker:
            return self._workers.add(connection.sections)
        if wish.kill is not None:
            return self._workers.kill(wish.kill)

        with self.lock:
            message, done = message_for(wish, self.scene.graph)
        connection.publish(message)
        return done

    def close(self) -> None:
        """Leave the bus."""
        self._has_ended.set()
        self._is_wanted.set()
        self._thread.join()
        self._driving.leave()
        self._workers.close()

    def _scene(self, replica: Replica, sections: Sections) -> Scene:
        settings = config.recorded(sections, "global_workspace", Config)
        planning = config.recorded(sections, "planning", PlanningConfig)
        return Scene(replica.graph, replica.follow, settings, planning, Path(self.label))

    def _work(self) -> None:
        while not self._has_ended.is_set():
            self._is_wanted.wait()
            if self._has_ended.is_set():
                break
            try:
                keys = environment.keys(*ACTS_OR_READS)
                bus = ZenohBus(self._endpoint, self._agent, self._has_ended.is_set, keys)
            except (NoRouterError, KeyboardInterrupt):
                self._has_ended.wait(RETRY_S)
                continue
            except AccessError as error:
                log.error("%s", error)
                self._has_ended.wait(ACCESS_RETRY_S)
                continue
            self._follow(bus)

    def _follow(self, bus: ZenohBus) -> None:
        """Follow the system until nobody watches it, or its router is gone."""
        replica = Replica(snapshot_over(bus))
        connection = Connection(bus)
        scene = self._scene(replica, connection.sections)
        with self.lock:
            scene.follow_on(self.scene)
            self.scene = scene
        try:
            replica.join()
            self._connection = connection
            while self._is_wanted.is_set() and not self._has_ended.is_set():
                connection.pump(self)
                if not bus.session.info.routers_zid():
                    break
        finally:
            self._connection = None
            bus.close()


class Connection:
    """Receives the messages of a system, and publishes what a person wishes.

    `sections` are the settings of its modules; there are none while no module answers.
    """

    def __init__(self, bus: ZenohBus) -> None:
        self._bus = bus
        self._inbox = Inbox()
        self._intake = Intake(Plausibility())
        self._numbers: Counter[Topic] = Counter()
        self._incarnation = time.time_ns()
        self._name = f"{DASHBOARD}-{os.getpid()}"
        bus.identify(Member(DASHBOARD, self._name))
        for topic in PUBLISHED:
            with suppress(AccessError):  # an observer's dashboard shows, as `publish` says then
                bus.declare(topic)
        for topic in FOLLOWED:
            bus.subscribe(topic, self._inbox.put, self._intake.count_lost)
        self.sections: Sections = {}
        with suppress(NoAnswerError):
            self.sections = settings_of(bus, ANSWER_S)

    def pump(self, live: Live) -> None:
        """Hand to the scene all that has arrived, waiting IDLE_S for the first of it."""
        item = self._inbox.take(IDLE_S)
        while item is not None:
            if isinstance(item, Arrival):
                message = self._intake.accept(item)
                if message is not None:
                    with live.lock:
                        live.scene.take(
                            item.topic, Arrived(message, item.envelope, item.received_ns)
                        )
            item = self._inbox.take(0.0)

    def publish(self, message: Message) -> None:
        """Publish a message of one of the topics PUBLISHED. Raises AccessError if our keys do not
        allow that.
        """
        topic = topics.of(message)
        self._bus.declare(topic)
        number = self._numbers[topic]
        self._numbers[topic] += 1
        now_ns = time.time_ns()
        envelope = Envelope(self._name, number, self._incarnation, now_ns, now_ns)
        numbered = msgspec.structs.replace(message, source=self._name, seq=number)
        self._bus.publish(topic, encode(numbered), envelope)


def _nowhere(_request: SnapshotRequest) -> Fetched:
    """Find no workspace, as where no bus is."""
    raise NoAnswerError("not on a bus")


def message_for(wish: Wish, graph: Graph) -> tuple[Message, str]:
    """Return what to publish for a wish, and a sentence on what that does. Raises UsageError."""
    if wish.street:
        done = "closed" if wish.closed else "opened"
        closure = StreetClosure(street=wish.street, closed=wish.closed)
        return closure, f"{wish.street} is to be {done}"

    if wish.step:
        return Pause(is_paused=True, views=1), "one view on"
    if wish.play is not None:
        done = "time is to pass" if wish.play else "time is to stand"
        return Pause(is_paused=not wish.play), done

    if wish.resets:
        return Reset(), "the robot of a simulation is carried back to its start"

    if wish.clear:
        goals = [DropNode(id=goal.id) for goal in graph.of_kind(Goal)]
        return Offer(cycle=graph.cycle, operations=[*goals]), "every goal is forgotten"

    if wish.goal is not None:
        if not called(wish.goal, graph):
            known = {node.name or node.label for node in graph.of_kind(Object)}
            meant = did_you_mean(wish.goal, sorted(known), "the map shows what it has")
            raise UsageError(f"the map has no object {wish.goal!r}: {meant}")
        goal = Goal(id=goal_id(wish.goal), base_level=1.0, object=wish.goal)
    elif wish.place is not None:
        x_m, y_m = wish.place
        goal = Goal(id=goal_id(f"{x_m:g},{y_m:g}"), base_level=1.0, x_m=x_m, y_m=y_m)
    else:
        raise UsageError("a running system has no other time than now: give a goal or a street")
    name = goal.id.removeprefix(goal_id(""))
    return Offer(cycle=graph.cycle, operations=[goal]), f"{name} is a goal now"
