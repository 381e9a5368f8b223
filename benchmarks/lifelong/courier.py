"""Sends the agent round a town without end: past the same places lap by lap, and to others."""

from __future__ import annotations

import numpy as np

from benchmarks.explore.drivable import Drivable
from benchmarks.explore.trials import Point, draw_goal
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id
from cogmap.schemas.sensing import TruePose, TrueTown

STOPS = 6
LEG_NS = 300_000_000_000


class Courier:
    """A module that offers one goal after another. A lap has the same STOPS each time; every other
    lap takes them in another order, with one place more that is drawn anew.
    """

    def __init__(self, seed: int) -> None:
        self.graph = Graph()
        self.laps = 0

        self._rng = np.random.default_rng([seed, 0x11FE])
        self._start: Floats | None = None
        self._town: TrueTown | None = None
        self._stops: list[Point] = []
        self._left: list[Point] = []
        self._offered = 0
        self._since_ns: int | None = None

    def module(self) -> Module:
        """The module to run beside the agent's."""
        return (
            Module("courier")
            .following(self.graph)
            .on(topics.TRUE_TOWN, self.on_town)
            .on(topics.TRUE_POSE, self.on_pose, (topics.OFFER,))
        )

    def on_town(self, town: TrueTown) -> None:
        """The town as it is."""
        self._town = town

    def on_pose(self, pose: TruePose) -> list[Message]:
        """Offer the next goal where the agent is at the last, or has not come there in time."""
        here_m = (pose.pose.x_m, pose.pose.y_m)
        if self._start is None:
            self._start = np.array([*here_m, pose.pose.heading_rad])
        if self._town is None or not self._is_free(pose.stamp_ns):
            return []

        dropped = [DropNode(id=self._goal_id)] if self._since_ns is not None else []
        if not self._left:
            self._left = self._next_lap(self._town, here_m)

        self._offered += 1
        self._since_ns = pose.stamp_ns
        x_m, y_m = transform_to(self._start, np.array([self._left.pop(0)]))[0].tolist()
        goal = Goal(id=self._goal_id, base_level=1.0, x_m=x_m, y_m=y_m)
        return [Offer(cycle=self.graph.cycle, operations=[*dropped, goal])]

    def _is_free(self, now_ns: int) -> bool:
        """Whether the last leg has ended."""
        if self._since_ns is None:
            return True

        goal = self.graph.get(Goal, self._goal_id)
        is_reached = goal is not None and goal.reached_ns != NEVER_NS
        return is_reached or now_ns - self._since_ns > LEG_NS

    def _next_lap(self, town: TrueTown, here_m: Point) -> list[Point]:
        """The places of the lap that begins."""
        drivable = Drivable.of(town)
        while len(self._stops) < STOPS:
            stop_m, _ = draw_goal(self._rng, town, drivable, here_m)
            self._stops.append(stop_m)

        self.laps += 1 if self._offered else 0
        if self.laps % 2 == 0:
            return list(self._stops)

        another_m, _ = draw_goal(self._rng, town, drivable, here_m)
        order = self._rng.permutation(STOPS).tolist()
        return [another_m, *(self._stops[number] for number in order)]

    @property
    def _goal_id(self) -> str:
        return goal_id(f"leg-{self._offered}")
