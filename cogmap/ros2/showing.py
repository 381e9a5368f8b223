"""What the agent believes and knows, shown to ROS: poses, transforms, path, plan, markers, grid."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cogmap.graph.graph import Graph
from cogmap.recording.exporting.moments import MAP_PERIOD_S, map_of
from cogmap.recording.exporting.ros_drive import RosDrive
from cogmap.recording.exporting.ros_messages import RosMessages
from cogmap.ros2.senses import Senses
from cogmap.runtime.module import Module
from cogmap.schemas.graph import Delta
from cogmap.schemas.nodes import Self

NAME = "ros2_map"

Say = Callable[[str, Any], None]
"""Publish a message of ROS on a topic."""


class Showing:
    """Follows the workspace, and says by `say` what it commits: each belief of where the robot is,
    and each MAP_PERIOD_S all of the map. `senses` returns what the robot senses, once it does.
    """

    def __init__(self, ros: RosMessages, say: Say, senses: Callable[[], Senses | None]) -> None:
        self._graph = Graph()
        self._drive = RosDrive(ros)
        self._say = say
        self._senses = senses
        self._map_due_ns = 0

    def module(self) -> Module:
        """Return the module that observes the workspace."""
        return Module(NAME).following(self._graph, self.on_delta)

    def on_delta(self, delta: Delta) -> None:
        """Show what has changed."""
        agent = self._graph.agent
        senses = self._senses()
        if agent is None or senses is None or not _has_pose(delta):
            return

        self._drive.odometry = senses.pose_in_odometry(agent.stamp_ns)
        self._drive.frames = senses.frames
        stamp_ns = senses.stamps.on_robot(agent.stamp_ns)
        shown = list(self._drive.shown(stamp_ns, agent))
        if agent.stamp_ns >= self._map_due_ns:
            self._map_due_ns = agent.stamp_ns + round(MAP_PERIOD_S * 1e9)
            shown += self._drive.shown(stamp_ns, map_of(self._graph))

        for topic, message in shown:
            self._say(topic, message)


def _has_pose(delta: Delta) -> bool:
    """Return whether a delta says where the robot is."""
    return any(isinstance(each, Self) for each in delta.operations)
