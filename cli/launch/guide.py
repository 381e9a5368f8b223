"""Guides an agent through a town: lets it explore, gives it goals, closes a street on its way."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.cli.launch.observer import Observer
from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import distances_along
from cogmap.graph.graph import Graph
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.nodes import NEVER_NS, PLAN_ID, Goal, Object, Plan, PlanState, goal_id
from cogmap.schemas.sensing import Street, StreetClosure, TrueTown

TOUR_GOALS = 3
KNOWN_SIGHTINGS = 3
BARRIER_AHEAD_M = 15.0
ON_ROUTE_M = 3.0
SAME_CROSSING_M = 1.0


class Stage(enum.Enum):
    """What the agent does on the tour."""

    EXPLORES = enum.auto()
    DRIVES = enum.auto()
    DETOURS = enum.auto()
    COMPLETE = enum.auto()


class Guide:
    """Offers goals when it is time, by the agent's graph and the town as it is.

    The agent explores for `explore_s`, or until nothing is left to explore. `goals` are then
    offered; TOUR_GOALS objects of its map, far from one another, where they are not given. A street
    of the route to the last goal is closed.
    """

    def __init__(self, explore_s: float, goals: Sequence[Goal] = ()) -> None:
        self.stage = Stage.EXPLORES
        self.closed = ""

        self._explore_s = explore_s
        self._given = list(goals)
        self._goals: list[str] = []

    @property
    def sentence(self) -> str:
        """Return a sentence on what the agent does now."""
        names = ", ".join(name.removeprefix(goal_id("")) for name in self._goals)
        match self.stage:
            case Stage.EXPLORES:
                return "the agent explores the town"
            case Stage.DRIVES:
                return f"its goals, in an order of its own: {names}"
            case Stage.DETOURS:
                return f"{self.closed} is closed on its route: it has to find another"
            case Stage.COMPLETE:
                return f"the agent was at every goal: {names}"

    def step(self, observer: Observer, graph: Graph) -> list[Message]:
        """Offer the goals, close the street, see whether all is done. Returns what to publish."""
        if observer.start is None:
            return []

        plan = graph.get(Plan, PLAN_ID)
        match self.stage:
            case Stage.EXPLORES:
                is_over = observer.elapsed_s >= self._explore_s and graph.agent is not None
                has_explored_all = (
                    observer.elapsed_s < self._explore_s
                    and plan is not None
                    and plan.planned_ns > 0
                    and plan.state is PlanState.NO_GOAL
                )
                if is_over or has_explored_all:
                    return self._offer(graph)
            case Stage.DRIVES | Stage.DETOURS:
                return self._follow(plan, observer, graph)
        return []

    def _offer(self, graph: Graph) -> list[Message]:
        goals = self._given or _far_apart(graph)
        if not goals:
            return []

        self.stage = Stage.DRIVES
        self._goals = [goal.id for goal in goals]
        return [Offer(cycle=graph.cycle, operations=[*goals])]

    def _follow(self, plan: Plan | None, observer: Observer, graph: Graph) -> list[Message]:
        """Complete the tour when all goals are reached. Once only the last is left, close a street
        that the route to it passes ahead, and that can be driven round.
        """
        goals = [graph.get(Goal, name) for name in self._goals]
        known = [goal for goal in goals if goal is not None]
        left = [goal for goal in known if goal.reached_ns == NEVER_NS]
        if len(known) == len(goals) and not left:
            self.stage = Stage.COMPLETE
            return []

        is_last = len(left) == 1 and plan is not None and plan.goals == [left[0].id]
        if not is_last or self.stage is Stage.DETOURS:
            return []
        if plan is None or plan.route is None or observer.town is None:
            return []

        route_m = np.asarray(plan.route.numpy(), np.float64)
        street = street_ahead(observer.town, observer.to_world(route_m))
        if street is None:
            return []

        self.stage = Stage.DETOURS
        self.closed = street.name
        return [StreetClosure(street=street.name, closed=True)]


def _far_apart(graph: Graph) -> list[Goal]:
    """Choose TOUR_GOALS objects as goals: each the farthest from those before and the agent."""
    agent = graph.agent
    known = [node for node in graph.of_kind(Object) if node.sightings >= KNOWN_SIGHTINGS]
    if agent is None or len(known) < TOUR_GOALS:
        return []

    places_m = np.array([(node.x_m, node.y_m) for node in known])
    away_m = np.hypot(*(places_m - (agent.x_m, agent.y_m)).T)
    goals = []
    for _ in range(TOUR_GOALS):
        farthest = int(away_m.argmax())
        label = known[farthest].label
        goals.append(Goal(id=goal_id(label), base_level=1.0, object=label))
        from_it_m = np.hypot(*(places_m - places_m[farthest]).T)
        away_m = np.minimum(away_m, from_it_m)

    return goals


def street_ahead(town: TrueTown, route_m: Floats) -> Street | None:
    """Find the street that a (n, 2) route passes first, of those ahead whose ends stay connected
    without it; None if there is none.
    """
    passed = [each for each in streets_ahead(town, route_m) if _is_avoidable(town, each.street)]
    first = min(passed, key=lambda each: each.along_m, default=None)
    return None if first is None else first.street


class Passed(NamedTuple):
    """A street whose middle a route passes `along_m` from its start."""

    street: Street
    along_m: float


def streets_ahead(town: TrueTown, route_m: Floats) -> list[Passed]:
    """Find the streets whose middle, where a barrier would stand, a (n, 2) route passes, at least
    BARRIER_AHEAD_M ahead; in the order of the town.
    """
    along_m = distances_along(route_m)
    passed = []
    for street in town.streets:
        middle_m = (np.array(street.line_m[0]) + street.line_m[-1]) / 2
        away_m = np.hypot(*(route_m - middle_m).T)
        nearest = int(away_m.argmin())
        if away_m[nearest] <= ON_ROUTE_M and along_m[nearest] >= BARRIER_AHEAD_M:
            passed.append(Passed(street, float(along_m[nearest])))

    return passed


def _is_avoidable(town: TrueTown, street: Street) -> bool:
    """Decide whether other streets connect the ends of a street."""
    reached = [street.line_m[0]]
    left = [each for each in town.streets if each.name != street.name and not each.closed]
    for here in reached:
        for each in list(left):
            ends = (each.line_m[0], each.line_m[-1])
            if min(math.dist(here, end) for end in ends) <= SAME_CROSSING_M:
                left.remove(each)
                reached.extend(ends)

    return min(math.dist(end, street.line_m[-1]) for end in reached) <= SAME_CROSSING_M
