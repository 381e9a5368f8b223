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
    Trial,
    believed_m,
    closed_as,
    draw_goal,
    sees_barrier,
    street_to_close,
)
from benchmarks.harness import TownObserver
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import NEVER_NS, PLAN_ID, Goal, Plan, goal_id
from cogmap.schemas.sensing import StreetClosure, TruePose, TrueTown

MAX_DRAWS = 20


class Experimenter(TownObserver):
    """Offers the agent one goal after another.

    The first `explore_s` are the agent's own. Of every two goals, one has a street on the planned
    route closed, which stays closed; if of MAX_DRAWS goals none can be closed off from its route
    and still be reached, the street that has been closed longest is opened again.
    """

    def __init__(self, seed: int, explore_s: float, goals: int) -> None:
        super().__init__()
        self.trials: list[Trial] = []
        self.explored_share = math.nan
        self.boundaries: BoundaryScore | None = None
        self.collisions = 0

        self._rng = np.random.default_rng([seed, 0xE8])
        self._explore_ns = round(explore_s * 1e9)
        self._goals = goals
        self._trial: Trial | None = None
        self._draws = 0
        self._offered = 0
        self._closed: list[str] = []
        self._opened: set[str] = set()

    @property
    def is_complete(self) -> bool:
        """Return whether all goals were reached or given up."""
        has_explored = not math.isnan(self.explored_share)
        return has_explored and len(self.trials) >= self._goals and self._trial is None

    def act(self, true: TruePose) -> list[Message]:
        """Begin the next drive if none runs, else see how this one fares."""
        self.collisions = true.collisions
        if self.town is None:
            return []

        # Of a street that is open again, an agent knows once its barrier would be in reach.
        here_m = np.array([true.pose.x_m, true.pose.y_m])
        for street in self.town.streets:
            if street.name in self._opened and sees_barrier(street, here_m):
                self._opened.discard(street.name)

        if true.stamp_ns < self._explore_ns:
            return []
        if math.isnan(self.explored_share):
            assert self.start is not None
            self.explored_share = explored_share(self.graph, self.town, self.start)
            self.boundaries = score_boundaries(self.graph, self.town, self.start)

        if self._trial is not None:
            return self._observe(true, self._trial, self.town)
        if self.is_complete:
            return []
        if self._draws < MAX_DRAWS or not self._closed:
            return [self._begin(true, self.town)]

        # Open the street that has been closed longest; the next drive waits for the town then.
        self.town = None
        self._draws = 0
        street_name = self._closed.pop(0)
        self._opened.add(street_name)
        return [StreetClosure(street=street_name, closed=False)]

    def _believed(self, town: TrueTown) -> TrueTown:
        """Return the town with those streets closed that an agent cannot know to be open."""
        return functools.reduce(closed_as, sorted(self._opened), town)

    def _begin(self, pose: TruePose, town: TrueTown) -> Offer:
        """Begin a drive, and return the offer of its goal."""
        here_m = (pose.pose.x_m, pose.pose.y_m)
        goal_m, shortest_m = draw_goal(self._rng, town, Drivable.of(town), here_m)

        number = len(self.trials)
        self._trial = Trial(
            start_m=here_m,
            goal_m=goal_m,
            began_ns=pose.stamp_ns,
            began_travelled_m=pose.travelled_m,
            closes=number % 2 == 1 and self._draws < MAX_DRAWS,
            shortest_m=shortest_m,
            unwarned_m=believed_m(town, self._believed(town), here_m, goal_m),
        )
        self._offered += 1
        x_m, y_m = self.to_map(np.array([goal_m]))[0].tolist()
        goal = Goal(id=self._goal_id, base_level=1.0, x_m=x_m, y_m=y_m)
        return Offer(cycle=self.graph.cycle, operations=[goal])

    def _observe(self, pose: TruePose, trial: Trial, town: TrueTown) -> list[Message]:
        """Close a street once there is a plan; end the drive at its goal, or in time."""
        goal = self.graph.get(Goal, self._goal_id)
        is_believed = goal is not None and goal.reached_ns != NEVER_NS
        is_late = pose.stamp_ns > trial.limit_ns
        if is_believed or is_late:
            away_m = math.dist((pose.pose.x_m, pose.pose.y_m), trial.goal_m)
            if away_m <= REACHED_WITHIN_M:
                trial.driven_m = pose.travelled_m - trial.began_travelled_m

            self.trials.append(trial)
            self._trial = None
            self._draws = 0
            return [self._take_back()]

        if not trial.closes or trial.closed:
            return []

        plan = self.graph.get(Plan, PLAN_ID)
        if plan is None or plan.route is None or self._goal_id not in plan.goals:
            return []

        # If no street of the route can be closed, another goal is taken.
        route_m = self.to_truth(np.asarray(plan.route.numpy(), np.float64))
        believed = self._believed(town)
        closure = street_to_close(self._rng, town, route_m, trial.goal_m, believed)
        if closure is None:
            self._draws += 1
            self._trial = None
            return [self._take_back()]

        trial.close(closure)
        self._closed.append(closure.street)
        self._opened.discard(closure.street)
        return [StreetClosure(street=trial.closed, closed=True)]

    def _take_back(self) -> Offer:
        return Offer(cycle=self.graph.cycle, operations=[DropNode(id=self._goal_id)])

    @property
    def _goal_id(self) -> str:
        return goal_id(str(self._offered))
