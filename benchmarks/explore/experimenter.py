"""Lets an agent explore a town, then gives it goals and closes streets on its way to them."""

from __future__ import annotations

import functools
import math

import numpy as np

from benchmarks.explore.boundaries import BoundaryScore
from benchmarks.explore.drivable import Drivable
from benchmarks.explore.judge import explored_share, score_boundaries
from benchmarks.explore.trials import (
    REACHED_WITHIN_M,
    Point,
    Trial,
    believed_m,
    closed_as,
    draw_goal,
    sees_barrier,
    street_to_close,
)
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from, transform_to
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import NEVER_NS, PLAN_ID, Goal, Plan, goal_id
from cogmap.schemas.sensing import StreetClosure, TruePose, TrueTown

MAX_DRAWS = 20


class Experimenter:
    """A module that follows the truth and the agent's graph, and offers one goal after another.

    The first `explore_s` are the agent's own. Of every two goals, one has a street on the planned
    route closed, which stays closed; where of MAX_DRAWS goals none can be closed off from its route
    and still be reached, the street that has been closed longest is opened again.
    """

    def __init__(self, seed: int, explore_s: float, goals: int) -> None:
        self.graph = Graph()
        self.trials: list[Trial] = []
        self.explored_share = math.nan
        self.boundaries: BoundaryScore | None = None
        self.collisions = 0

        self._rng = np.random.default_rng([seed, 0xE8])
        self._explore_ns = round(explore_s * 1e9)
        self._goals = goals
        self._start: Floats | None = None
        self._town: TrueTown | None = None
        self._trial: Trial | None = None
        self._draws = 0
        self._offered = 0
        self._closed: list[str] = []
        self._opened: set[str] = set()

    @property
    def is_complete(self) -> bool:
        """Whether all goals were reached or given up."""
        has_explored = not math.isnan(self.explored_share)
        return has_explored and len(self.trials) >= self._goals and self._trial is None

    def module(self) -> Module:
        """The module to run beside the agent's."""
        emits = (topics.OFFER, topics.STREET_CLOSURE)
        return (
            Module("experimenter")
            .following(self.graph)
            .on(topics.TRUE_TOWN, self.on_town)
            .on(topics.TRUE_POSE, self.on_pose, emits)
        )

    def on_town(self, town: TrueTown) -> None:
        """The town as it is now."""
        self._town = town

    def on_pose(self, pose: TruePose) -> list[Message]:
        """Begin the next drive where none runs, else see how this one fares."""
        here = np.array([pose.pose.x_m, pose.pose.y_m, pose.pose.heading_rad])
        if self._start is None:
            self._start = here

        self.collisions = pose.collisions
        self._see_opened(here[:2])
        if pose.stamp_ns < self._explore_ns or self._town is None:
            return []
        if math.isnan(self.explored_share):
            self.explored_share = explored_share(self.graph, self._town, self._start)
            self.boundaries = score_boundaries(self.graph, self._town, self._start)

        if self._trial is not None:
            return self._observe(pose, self._trial)
        if self.is_complete:
            return []
        return self._begin(pose) if self._draws < MAX_DRAWS or not self._closed else self._reopen()

    def _reopen(self) -> list[Message]:
        """Open the street that has been closed longest; the next drive waits for the town then."""
        self._town = None
        self._draws = 0
        street = self._closed.pop(0)
        self._opened.add(street)
        return [StreetClosure(street=street, closed=False)]

    def _see_opened(self, here_m: Floats) -> None:
        """Of a street that is open again, an agent knows once its barrier would be in reach."""
        if self._town is None or not self._opened:
            return

        for street in self._town.streets:
            if street.name in self._opened and sees_barrier(street, here_m):
                self._opened.discard(street.name)

    def _believed(self, town: TrueTown) -> TrueTown:
        """The town with the streets closed of which an agent cannot know that they are open."""
        return functools.reduce(closed_as, sorted(self._opened), town)

    def _begin(self, pose: TruePose) -> list[Message]:
        """Offer the next goal."""
        assert self._town is not None
        here_m = (pose.pose.x_m, pose.pose.y_m)
        drivable = Drivable.of(self._town)
        goal_m, shortest_m = draw_goal(self._rng, self._town, drivable, here_m)

        number = len(self.trials)
        self._trial = Trial(
            start_m=here_m,
            goal_m=goal_m,
            began_ns=pose.stamp_ns,
            began_travelled_m=pose.travelled_m,
            closes=number % 2 == 1 and self._draws < MAX_DRAWS,
            shortest_m=shortest_m,
            unwarned_m=believed_m(self._town, self._believed(self._town), here_m, goal_m),
        )
        self._offered += 1
        x_m, y_m = self._on_map(goal_m)
        goal = Goal(id=self._goal_id, base_level=1.0, x_m=x_m, y_m=y_m)
        return [Offer(cycle=self.graph.cycle, operations=[goal])]

    def _observe(self, pose: TruePose, trial: Trial) -> list[Message]:
        """Close a street once there is a plan; end the drive at its goal, or in time."""
        goal = self.graph.get(Goal, self._goal_id)
        is_believed = goal is not None and goal.reached_ns != NEVER_NS
        is_late = pose.stamp_ns > trial.limit_ns
        if is_believed or is_late:
            return self._end(pose, trial)

        if not trial.closes or trial.closed:
            return []

        plan = self.graph.get(Plan, PLAN_ID)
        if plan is None or plan.route is None or self._goal_id not in plan.goals:
            return []
        return self._close(trial, plan)

    def _close(self, trial: Trial, plan: Plan) -> list[Message]:
        """Close a street of the planned route; where none can be, take another goal."""
        assert self._town is not None
        assert self._start is not None
        assert plan.route is not None
        route_m = transform_from(self._start, np.asarray(plan.route.numpy(), np.float64))
        believed = self._believed(self._town)
        closure = street_to_close(self._rng, self._town, route_m, trial.goal_m, believed)
        if closure is None:
            drop = DropNode(id=self._goal_id)
            self._draws += 1
            self._trial = None
            return [Offer(cycle=self.graph.cycle, operations=[drop])]

        trial.close(closure)
        self._closed.append(closure.street)
        self._opened.discard(closure.street)
        return [StreetClosure(street=trial.closed, closed=True)]

    def _end(self, pose: TruePose, trial: Trial) -> list[Message]:
        """Note whether the agent is at the goal in truth, and take the goal back."""
        away_m = math.dist((pose.pose.x_m, pose.pose.y_m), trial.goal_m)
        if away_m <= REACHED_WITHIN_M:
            trial.driven_m = pose.travelled_m - trial.began_travelled_m

        drop = DropNode(id=self._goal_id)
        self.trials.append(trial)
        self._trial = None
        self._draws = 0
        return [Offer(cycle=self.graph.cycle, operations=[drop])]

    @property
    def _goal_id(self) -> str:
        return goal_id(str(self._offered))

    def _on_map(self, point_m: Point) -> Point:
        """A true position in the frame of the agent's map."""
        assert self._start is not None
        x_m, y_m = transform_to(self._start, np.array([point_m]))[0].tolist()
        return x_m, y_m
