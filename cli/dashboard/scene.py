"""What a dashboard shows: follows a system's messages, and makes the parts of the page. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cogmap.cli.dashboard import parts
from cogmap.cli.dashboard.atlas import costs_part, cuts_part, map_part, places_part, truth_part
from cogmap.cli.dashboard.health import system_part
from cogmap.cli.dashboard.mind import mind_part
from cogmap.cli.dashboard.parts import PartName, flat
from cogmap.cli.dashboard.pictures import JPEG, data_url, depth_jpeg, view_jpeg
from cogmap.cli.dashboard.received import Arrived, Received
from cogmap.cli.explain import names
from cogmap.errors import LogError
from cogmap.graph.graph import Graph
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.cognition import Action, Broadcast, Competition
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import PLAN_ID, Plan
from cogmap.schemas.process import Health, Paused
from cogmap.schemas.sensing import (
    Energy,
    MotorCommand,
    Odometry,
    Percept,
    Percepts,
    TruePose,
    TrueTown,
    View,
)
from cogmap.schemas.topics import Scope, Topic
from cogmap.services.codelets.public import PlanningConfig
from cogmap.services.global_workspace.config import Config

FOLLOWED = tuple(topic for topic in topics.ALL if topic is not topics.STEREO)
"""The topics that it follows: views have the images of stereo frames, and depth."""

NAMES = 3
"""Names of a percept that are shown, the likeliest."""

_CHANGED_BY: dict[type[Message], tuple[PartName, ...]] = {
    Delta: (PartName.NOW, PartName.MAP, PartName.PLACES, PartName.COSTS, PartName.CUTS),
    MotorCommand: (PartName.NOW, PartName.SYSTEM),
    Energy: (PartName.NOW,),
    View: (PartName.CAMERA, PartName.DEPTH),
    Percepts: (PartName.CAMERA,),
    Competition: (PartName.MIND,),
    Broadcast: (PartName.MIND, PartName.NOW),
    Action: (PartName.MIND, PartName.NOW),
    Health: (PartName.SYSTEM,),
    Paused: (PartName.NOW,),
    TrueTown: (PartName.STREETS, PartName.TRUTH),
    TruePose: (PartName.TRUTH,),
}


class Scene:
    """What is seen of one system. `graph` is its workspace's, which `follow` keeps: it takes a
    delta and the incarnation that published it.

    Each part of what is shown has a version, which rises as something of it changes. `settings` are
    those of the global workspace, by which a competition is explained, `planning` those by which
    places cost; `place` is where the messages come from.
    """

    def __init__(
        self,
        graph: Graph,
        follow: Callable[[Delta, int | None], object],
        settings: Config,
        planning: PlanningConfig,
        place: Path,
    ) -> None:
        self.graph = graph
        self.received = Received()
        self.versions: Counter[PartName] = Counter(PartName)
        self._follow = follow
        self._settings = settings
        self._planning = planning
        self._place = place

    def take(self, topic: Topic, arrived: Arrived) -> None:
        """Take account of one message."""
        message = arrived.message
        self.received.add(topic, arrived)
        if isinstance(message, Delta):
            envelope = arrived.envelope
            self._follow(message, None if envelope is None else envelope.incarnation)

        for part in (*_CHANGED_BY.get(type(message), ()), PartName.TOPICS):
            self.versions[part] += 1

    def follow_on(self, before: Scene) -> None:
        """Be shown in the place of another scene: every part is another one."""
        for part in PartName:
            self.versions[part] = before.versions[part] + 1

    def part(self, name: PartName) -> parts.Part:
        """Return a part as it is now."""
        received = self.received
        made: dict[PartName, Callable[[], parts.Part]] = {
            PartName.NOW: self._now,
            PartName.MAP: lambda: map_part(self.graph),
            PartName.PLACES: lambda: places_part(self.graph),
            PartName.COSTS: lambda: costs_part(self.graph, self._planning),
            PartName.CUTS: lambda: cuts_part(self.graph),
            PartName.CAMERA: self._camera,
            PartName.DEPTH: self._depth,
            PartName.MIND: lambda: mind_part(received, self.graph, self._settings, self._place),
            PartName.SYSTEM: lambda: system_part(received),
            PartName.TOPICS: self._topics,
            PartName.STREETS: self._streets,
            PartName.TRUTH: self._truth,
        }
        return made[name]()

    def _now(self) -> parts.Now:
        received = self.received
        stamps_ns = [
            each.message.stamp_ns
            for topic, each in received.newest.items()
            if topic.scope is Scope.MODEL
        ]
        now = parts.Now(cycle=self.graph.cycle, at_s=max(stamps_ns, default=0) / 1e9)
        agent = self.graph.agent
        if agent is not None:
            now.pose = (round(agent.x_m, 3), round(agent.y_m, 3), round(agent.heading_rad, 4))
            now.pose_sd_m = round(float(np.hypot(agent.x_sd_m, agent.y_sd_m)), 3)
            now.samples = flat(agent.samples.numpy()[:, :2])

        motion = received.message(topics.ODOMETRY)
        if isinstance(motion, Odometry):
            now.speed_m_s = motion.speed_m_s
        command = received.message(topics.MOTOR_COMMAND)
        if isinstance(command, MotorCommand):
            now.halted_by = command.halted_by.value
            now.slowed_by = command.slowed_by.value
        paused = received.message(topics.PAUSED)
        if isinstance(paused, Paused):
            now.is_paused = paused.is_paused
        energy = received.message(topics.ENERGY)
        if isinstance(energy, Energy):
            now.energy = energy.level
            now.is_charging = energy.is_charging

        action = received.message(topics.ACTION)
        if isinstance(action, Action):
            now.action = names.spoken(action.scheme)
        if received.broadcasts:
            coalition = received.broadcasts[-1].coalition
            now.conscious = f"{names.spoken(coalition.codelet)}: {names.content(coalition)}"
        plan = self.graph.get(Plan, PLAN_ID)
        if plan is not None:
            now.plan = names.of_plan(plan)
        return now

    def _camera(self) -> parts.Camera:
        camera = parts.Camera()
        view = self.received.message(topics.VIEW)
        percepts = self.received.message(topics.PERCEPTS)
        if isinstance(view, View):
            camera.frame = view.frame
            camera.at_s = view.stamp_ns / 1e9
            camera.width_px = view.calibration.width_px
            camera.height_px = view.calibration.height_px
            camera.picture = _picture(view, view_jpeg)
        if isinstance(percepts, Percepts):
            camera.percepts_frame = percepts.frame
            camera.seen = [_seen(each) for each in percepts.objects]
        return camera

    def _depth(self) -> parts.Depth:
        view = self.received.message(topics.VIEW)
        return parts.Depth(picture=_picture(view, depth_jpeg) if isinstance(view, View) else "")

    def _streets(self) -> parts.Streets:
        town = self.received.message(topics.TRUE_TOWN)
        if not isinstance(town, TrueTown):
            return parts.Streets()
        return parts.Streets(names=[street.name for street in town.streets])

    def _truth(self) -> parts.Truth:
        received = self.received
        town = received.message(topics.TRUE_TOWN)
        assert town is None or isinstance(town, TrueTown)
        return truth_part(town, received.start, received.true_path_m)

    def _topics(self) -> parts.Topics:
        counts = self.received.counts
        rows = [
            parts.TopicCount(name=topic.name, type=topic.type.__name__, count=counts[topic])
            for topic in topics.ALL
            if counts[topic]
        ]
        return parts.Topics(topics=rows)


def _picture(view: View, draw: Callable[[View], bytes]) -> str:
    """Return a picture of a view; none of a view whose arrays are no images."""
    try:
        return data_url(JPEG, draw(view))
    except LogError:
        return ""


def _seen(percept: Percept) -> parts.Seen:
    left, top, width, height = percept.box_px
    right = left + width
    bottom = top + height
    box = [(left, top), (right, top), (right, bottom), (left, bottom)]
    likely = sorted(percept.names.items(), key=lambda item: -item[1])
    return parts.Seen(
        outline=flat(percept.outline_px or box),
        name=names.of_look(percept.name),
        label=percept.label,
        activation=round(percept.activation, 3),
        range_m=round(percept.range_m, 2),
        bearing_deg=round(float(np.degrees(percept.bearing_rad)), 1),
        names=[(names.spoken(name), round(share, 3)) for name, share in likely[:NAMES]],
    )
