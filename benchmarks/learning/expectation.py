"""Whether surprises become conscious: buildings that are gone and streets that are closed, in towns
that the agent has explored, at the level of percepts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from benchmarks.explore.drivable import barrier_m
from benchmarks.explore.measure import COGNITION, sections
from benchmarks.explore.trials import street_to_close
from benchmarks.learning.eyes import Eyes
from benchmarks.report import Metrics
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.graph.graph import Graph
from cogmap.parallel import parallel_map
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.cognition import Broadcast
from cogmap.schemas.graph import DropNode
from cogmap.schemas.nodes import (
    NEVER_NS,
    PLAN_ID,
    Goal,
    LinkKind,
    Object,
    Plan,
    goal_id,
    look_of,
    place_cell,
)
from cogmap.schemas.sensing import StreetClosure, TruePose, TrueTown
from cogmap.services import registry
from cogmap.services.codelets.attention import expectation
from cogmap.services.sim.config import Config as SimConfig
from cogmap.services.sim.config import place_of
from cogmap.services.sim.layout.place import Place

TOWNS = 4
FIRST_SEED = 501
EXPLORE_S = 400.0
REMOVED = 6
GOAL_S = 150.0
# Both so that nobody would miss it: seen for a second, from nearer than a crossing's width of
# streets.
ONSET_VIEWS = 5
NOTICEABLE_M = 30.0
CONSCIOUS_WITHIN_S = 3.0
SAME_M = 12.0
SAME_BARRIER_M = 20.0


@dataclass
class Surprise:
    """Something that is not as the agent knows it: when it could first be noticed, for ONSET_VIEWS
    views on end, and when it first was conscious.
    """

    at_m: tuple[float, float]
    onset_ns: int | None = None
    conscious_ns: int | None = None
    views_ns: list[int] = field(default_factory=list)

    def note(self, stamp_ns: int, is_noticeable: bool) -> None:
        """It is noticeable in a view, or it is not."""
        if self.onset_ns is not None:
            return
        self.views_ns = [*self.views_ns, stamp_ns] if is_noticeable else []
        if len(self.views_ns) == ONSET_VIEWS:
            self.onset_ns = self.views_ns[0]

    @property
    def was_conscious(self) -> bool:
        """Whether it was conscious in time."""
        if self.onset_ns is None or self.conscious_ns is None:
            return False
        return self.conscious_ns - self.onset_ns <= CONSCIOUS_WITHIN_S * 1e9


@dataclass(frozen=True)
class Surprises:
    """What was there to be surprised by in a town, and how often the agent was by nothing."""

    buildings: list[Surprise]
    streets: list[Surprise]
    false: int


def measure(processes: int, towns: int = TOWNS) -> Metrics:
    """The share of surprises that were conscious in time, over so many towns."""
    found = parallel_map(surprises_in, list(range(FIRST_SEED, FIRST_SEED + towns)), processes)
    buildings = [each for town in found for each in town.buildings]
    streets = [each for town in found for each in town.streets]
    return {
        "expectation_share": _share([*buildings, *streets]),
        "expectation_share_buildings": _share(buildings),
        "expectation_share_streets": _share(streets),
        "surprises": float(len(buildings) + len(streets)),
        "false_surprises": float(sum(town.false for town in found)),
    }


def surprises_in(seed: int) -> Surprises:
    """Explore a town, then drive past buildings that are gone, and into streets that are closed."""
    configured = sections(seed)
    place = place_of(SimConfig(seed=seed, town="blocks"))
    rng = np.random.default_rng([seed, 0x5E])
    removed = sorted(rng.choice(len(place.plots), REMOVED, replace=False).tolist())
    removals = [{"building": number, "from_s": EXPLORE_S} for number in removed]
    configured["sim"] |= {"removals": removals}

    judge = _Judge(place, removed, rng)
    modules = [registry.build(name, configured) for name in ("sim", *COGNITION)]
    with InProcessRunner([*modules, judge.module()]) as runner:
        runner.run(lambda: judge.is_complete)

    return judge.surprises


class _Judge:
    """Follows the truth and the agent's graph. After it has explored the agent is given the
    buildings that are gone as goals; on the way to each a street is closed.
    """

    def __init__(self, place: Place, removed: list[int], rng: np.random.Generator) -> None:
        self.graph = Graph()
        self._place = place
        self._eyes = Eyes(place)
        self._removed = removed
        self._rng = rng

        self._start: Floats | None = None
        self._town: TrueTown | None = None
        self._known: dict[int, str] | None = None
        self._buildings: dict[int, Surprise] = {}
        self._streets: dict[str, Surprise] = {}
        self._false = 0
        self._goals: list[str] = []
        self._goal_until_ns = 0
        self._has_closed = False
        self.is_complete = False

    def module(self) -> Module:
        """The module to run beside the agent's."""
        emits = (topics.OFFER, topics.STREET_CLOSURE)
        return (
            Module("judge")
            .following(self.graph)
            .on(topics.TRUE_TOWN, self.on_town)
            .on(topics.TRUE_POSE, self.on_pose, emits)
            .on(topics.BROADCAST, self.on_broadcast)
        )

    @property
    def surprises(self) -> Surprises:
        """Those that could be noticed."""
        buildings = [each for each in self._buildings.values() if each.onset_ns is not None]
        streets = [each for each in self._streets.values() if each.onset_ns is not None]
        return Surprises(buildings, streets, self._false)

    def on_town(self, town: TrueTown) -> None:
        """The town as it is now."""
        self._town = town

    def on_pose(self, pose: TruePose) -> list[Message]:
        """Note what can be noticed from here, and lead the agent on."""
        at = np.array([pose.pose.x_m, pose.pose.y_m, pose.pose.heading_rad])
        if self._start is None:
            self._start = at
        if pose.stamp_ns < EXPLORE_S * 1e9:
            return []
        if self._known is None:
            self._begin()

        self._note(pose.stamp_ns, at)
        return self._lead(pose.stamp_ns)

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Note what surprise is conscious."""
        if broadcast.coalition.codelet != expectation.NAME or self._known is None:
            return

        for node in broadcast.coalition.nodes:
            if isinstance(node, Object):
                self._note_gone(node, broadcast.stamp_ns)

        for link in broadcast.coalition.links:
            cell = place_cell(link.target)
            if link.kind == LinkKind.BLOCKED and cell is not None:
                self._note_closed(cell, broadcast.stamp_ns)

    def _begin(self) -> None:
        """Buildings are gone from now on: the agent's map has some of them."""
        known = {}
        for number in self._removed:
            label = self._label_of(number)
            if label:
                plot = self._place.plots[number]
                known[number] = label
                self._buildings[number] = Surprise((plot.x_m, plot.y_m))

        self._known = known
        self._goals = list(known.values())

    def _label_of(self, number: int) -> str:
        """What the agent calls a building, where its map has it; empty where it has not."""
        plot = self._place.plots[number]
        for node in self.graph.of_kind(Object):
            away_m = math.dist(self._in_truth(node.x_m, node.y_m), (plot.x_m, plot.y_m))
            if look_of(node.label) == plot.kind.name and away_m <= SAME_M:
                return node.label

        return ""

    def _note(self, stamp_ns: int, at: Floats) -> None:
        for number, surprise in self._buildings.items():
            away_m = math.dist(surprise.at_m, (at[0], at[1]))
            is_near = away_m <= NOTICEABLE_M
            surprise.note(stamp_ns, is_near and self._eyes.sees_building(at, number))

        for name, surprise in self._streets.items():
            surprise.note(stamp_ns, self._eyes.sees_barrier(at, name, NOTICEABLE_M))

    def _note_gone(self, node: Object, stamp_ns: int) -> None:
        at_m = self._in_truth(node.x_m, node.y_m)
        for number, surprise in self._buildings.items():
            plot = self._place.plots[number]
            if look_of(node.label) == plot.kind.name and math.dist(at_m, surprise.at_m) <= SAME_M:
                if surprise.conscious_ns is None:
                    surprise.conscious_ns = stamp_ns
                return

        self._false += 1

    def _note_closed(self, cell: tuple[str, int, int], stamp_ns: int) -> None:
        map_id, i, j = cell
        cell_m = self.graph.cell_m(map_id)
        at_m = self._in_truth(i * cell_m, j * cell_m)
        for surprise in self._streets.values():
            if math.dist(at_m, surprise.at_m) <= SAME_BARRIER_M:
                if surprise.conscious_ns is None:
                    surprise.conscious_ns = stamp_ns
                return

        self._false += 1

    def _lead(self, stamp_ns: int) -> list[Message]:
        """Give the agent the next goal where it is at this one, or has had it for long enough."""
        if not self._goals:
            self.is_complete = True
            return []

        goal = goal_id(self._goals[0])
        node = self.graph.get(Goal, goal)
        if not self._goal_until_ns:
            self._goal_until_ns = stamp_ns + round(GOAL_S * 1e9)
            self._has_closed = False
            offered = Goal(id=goal, base_level=1.0, object=self._goals[0])
            return [Offer(cycle=self.graph.cycle, operations=[offered])]

        is_reached = node is not None and node.reached_ns != NEVER_NS
        if is_reached or stamp_ns > self._goal_until_ns:
            self._goals.pop(0)
            self._goal_until_ns = 0
            return [Offer(cycle=self.graph.cycle, operations=[DropNode(id=goal)])]

        return [] if self._has_closed else self._close(goal)

    def _close(self, goal: str) -> list[Message]:
        """Close a street of the route to the goal, where one can be."""
        plan = self.graph.get(Plan, PLAN_ID)
        if plan is None or plan.route is None or goal not in plan.goals or self._town is None:
            return []

        assert self._start is not None
        self._has_closed = True
        route_m = transform_from(self._start, np.asarray(plan.route.numpy(), np.float64))
        goal_x_m, goal_y_m = route_m[-1].tolist()
        closure = street_to_close(self._rng, self._town, route_m, (goal_x_m, goal_y_m))
        if closure is None or closure.street in self._streets:
            return []

        (street,) = [each for each in self._town.streets if each.name == closure.street][:1]
        middle_m = np.asarray(barrier_m(street), np.float64).mean(axis=0).tolist()
        self._streets[closure.street] = Surprise((middle_m[0], middle_m[1]))
        return [StreetClosure(street=closure.street, closed=True)]

    def _in_truth(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A position of the agent's map in the true frame."""
        assert self._start is not None
        true_x_m, true_y_m = transform_from(self._start, np.array([[x_m, y_m]]))[0].tolist()
        return true_x_m, true_y_m


def _share(surprises: list[Surprise]) -> float:
    if not surprises:
        return math.nan
    return float(np.mean([each.was_conscious for each in surprises]))
