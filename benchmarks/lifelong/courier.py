"""Sends the agent round a town without end: past the same places lap by lap, and to others."""

from __future__ import annotations

import numpy as np

from benchmarks.explore.drivable import Drivable
from benchmarks.explore.trials import Point, draw_goal
from benchmarks.harness import TownObserver
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode, Operation
from cogmap.schemas.nodes import NEVER_NS, Goal, goal_id
from cogmap.schemas.sensing import TruePose

STOPS = 6
LEG_NS = 300_000_000_000


class Courier(TownObserver):
    """Offers one goal after another. A lap has the same STOPS each time; every other lap takes them
    in another order, with one place more that is drawn anew.
    """

    def __init__(self, seed: int) -> None:
        super().__init__()
        self.laps = 0

        self._rng = np.random.default_rng([seed, 0x11FE])
        self._stops: list[Point] = []
        self._left: list[Point] = []
        self._offered = 0
        self._since_ns: int | None = None

    def act(self, true: TruePose) -> list[Message]:
        """Offer the next goal if the agent is at the last, or has not come there in time."""
        if self.town is None:
            return []

        operations: list[Operation] = []
        if self._since_ns is not None:
            goal = self.graph.get(Goal, self._goal_id)
            is_reached = goal is not None and goal.reached_ns != NEVER_NS
            if not is_reached and true.stamp_ns - self._since_ns <= LEG_NS:
                return []
            operations = [DropNode(id=self._goal_id)]

        if not self._left:
            here_m = (true.pose.x_m, true.pose.y_m)
            drivable = Drivable.of(self.town)
            while len(self._stops) < STOPS:
                stop_m, _ = draw_goal(self._rng, self.town, drivable, here_m)
                self._stops.append(stop_m)

            self.laps += 1 if self._offered else 0
            self._left = list(self._stops)
            if self.laps % 2 == 1:
                another_m, _ = draw_goal(self._rng, self.town, drivable, here_m)
                order = self._rng.permutation(STOPS).tolist()
                self._left = [another_m, *(self._stops[number] for number in order)]

        self._offered += 1
        self._since_ns = true.stamp_ns
        x_m, y_m = self.to_map(np.array([self._left.pop(0)]))[0].tolist()
        goal = Goal(id=self._goal_id, base_level=1.0, x_m=x_m, y_m=y_m)
        return [Offer(cycle=self.graph.cycle, operations=[*operations, goal])]

    @property
    def _goal_id(self) -> str:
        return goal_id(f"leg-{self._offered}")
