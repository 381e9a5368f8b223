"""Follows an agent that explores a town, and sends it back to buildings by their names."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.explore.drivable import CELL_M, Drivable
from benchmarks.explore.trials import GRACE_S, REACHED_WITHIN_M, SLOWEST_M_S, Point
from benchmarks.harness import TownObserver
from cogmap.cli.launch.individuals.judge import Judgement, judge
from cogmap.cli.launch.individuals.percepts import PerceptTally
from cogmap.cli.launch.observer import Observer
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode
from cogmap.schemas.nodes import NEVER_NS, Goal, LoopClosure, Object, goal_id
from cogmap.schemas.sensing import Percepts, TruePose, TrueTown


@dataclass(frozen=True)
class Plan:
    """What is done in a town: how long the agent explores, to how many buildings it is sent then,
    and how long the visit lasts at least.
    """

    explore_s: float
    goals: int = 0
    least_s: float = 0.0


@dataclass(frozen=True)
class Errand:
    """A drive to the building whose middle is at `middle_m`, to which the robot can come as near as
    `nearest_m`; given up at `until_s`. `goal` is the id of its goal.
    """

    goal: str
    middle_m: Point
    nearest_m: float
    until_s: float

    def is_at(self, here_m: Point) -> bool:
        """Decide whether the robot is there."""
        return math.dist(here_m, self.middle_m) <= self.nearest_m + REACHED_WITHIN_M


class Visitor(TownObserver):
    """Has the map judged once the agent has explored. Then it sends it to one of the buildings that
    it saw often after the other, by the name that its individual has on the map. The visit is over
    when the agent was at all of them, or did not come there in time.

    The truth decides whether it was there. To a building that is not on the map no name leads.
    """

    def __init__(self, seed: int, plan: Plan) -> None:
        super().__init__()
        self.observer = Observer()
        self.tally = PerceptTally()
        self.percepts: list[Percepts] = []
        self.closures: dict[str, LoopClosure] = {}
        self.explored: Judgement | None = None
        self.reached: list[bool] = []
        self.now_s = 0.0

        self._plan = plan
        self._rng = np.random.default_rng([seed, 0x1D])
        self._left: list[int] = []
        self._errand: Errand | None = None
        self._drivable: Drivable | None = None

    def watching(self) -> Module:
        """Return the module to run beside the agent's."""
        module = self.module("visitor", [topics.OFFER])
        module.on(topics.PERCEPTS, self.on_percepts)
        for topic in (topics.ODOMETRY, topics.SELF_MOTION):
            module.on(topic, self.observer.update)
        return module

    @property
    def is_over(self) -> bool:
        """Return whether all is done."""
        has_driven = self.explored is not None and not self._left and self._errand is None
        return has_driven and self.now_s >= self._plan.least_s

    @property
    def share(self) -> float:
        """Return about how much of the visit is over."""
        explored = min(1.0, self.now_s / self._plan.explore_s)
        return (explored + len(self.reached)) / (1 + self._plan.goals)

    def judged(self) -> Judgement:
        """Judge the map as it is now."""
        assert self.town is not None
        return judge(self.tally, self.town, self.graph, self.observer.to_world)

    def on_town(self, town: TrueTown) -> None:
        """Take the town."""
        super().on_town(town)
        self.observer.update(town)
        self._drivable = Drivable.of(town)

    def on_percepts(self, percepts: Percepts) -> None:
        """Keep what was perceived."""
        self.percepts.append(percepts)
        self.tally.update(percepts)

    def on_delta(self, delta: Delta) -> None:
        """Note what percepts were given to, and the closures; one that is dropped once it was
        accepted has made the map what it is.
        """
        self.observer.update(delta)
        self.tally.update(delta)
        for operation in delta.operations:
            if isinstance(operation, LoopClosure):
                self.closures[operation.id] = operation

    def act(self, true: TruePose) -> list[Message]:
        """Judge the map once the agent has explored; from then on, offer the next goal when the
        agent is at the last, or late.
        """
        self.observer.update(true)
        self.tally.update(true)
        self.now_s = true.stamp_ns / 1e9
        if self.now_s < self._plan.explore_s:
            return []
        if self.explored is None:
            self.explored = self.judged()
            drawn = self._rng.permutation(self.explored.seen)
            self._left = drawn[: self._plan.goals].tolist()

        here_m = (true.pose.x_m, true.pose.y_m)
        if self._errand is not None:
            goal = self.graph.get(Goal, self._errand.goal)
            believes = goal is not None and goal.reached_ns != NEVER_NS
            if not believes and self.now_s < self._errand.until_s:
                return []

            self.reached.append(self._errand.is_at(here_m))
            forgotten = DropNode(id=self._errand.goal)
            self._errand = None
            return [Offer(cycle=self.graph.cycle, operations=[forgotten])]

        return self._begin(here_m)

    def _begin(self, here_m: Point) -> list[Message]:
        """Offer the next goal that the map has."""
        while self._left:
            building = self._left.pop(0)
            node = self._individual(building)
            if node is None:
                self.reached.append(False)
                continue

            self._errand = self._to(building, here_m)
            goal = Goal(id=self._errand.goal, base_level=1.0, object=node.label)
            return [Offer(cycle=self.graph.cycle, operations=[goal])]

        return []

    def _individual(self, building: int) -> Object | None:
        """Return the object that most percepts of a building were given to; None without one."""
        found = self.judged().of(building)
        return found[0].node if found else None

    def _to(self, building: int, here_m: Point) -> Errand:
        """Return the errand to a building."""
        assert self.explored is not None
        assert self._drivable is not None
        x_m, y_m = self.explored.buildings.centres_m[building].tolist()
        lengths_m = self._drivable.lengths_from(*here_m)
        cells = np.argwhere(np.isfinite(lengths_m))
        away_m = np.hypot(*(self._drivable.corner_m + cells * CELL_M - (x_m, y_m)).T)
        nearest = int(away_m.argmin())

        length_m = float(lengths_m[tuple(cells[nearest])])
        limit_s = GRACE_S + 3 * length_m / SLOWEST_M_S
        name = goal_id(f"building-{len(self.reached)}")
        return Errand(name, (x_m, y_m), float(away_m[nearest]), self.now_s + limit_s)
