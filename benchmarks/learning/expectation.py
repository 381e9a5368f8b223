"""Surprises that become conscious: buildings that are gone and streets that are closed, in towns
that the agent has explored, at the level of percepts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from benchmarks.explore.drivable import barrier_m
from benchmarks.explore.trials import Point, street_to_close
from benchmarks.harness import (
    COGNITION,
    TownObserver,
    build,
    pose_array,
    running,
    town_sections,
)
from benchmarks.learning.visibility import Visibility
from benchmarks.report import Metrics
from cogmap.cli.progress import bar
from cogmap.parallel import parallel_map
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
    place_cell,
)
from cogmap.schemas.sensing import StreetClosure, TruePose
from cogmap.services.codelets.public import expectation
from cogmap.services.sim.public import Place, SimConfig, place_of

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

    at_m: Point
    onset_ns: int | None = None
    conscious_ns: int | None = None
    views_ns: list[int] = field(default_factory=list)

    def note(self, stamp_ns: int, is_noticeable: bool) -> None:
        """Note whether it is noticeable in a view."""
        if self.onset_ns is not None:
            return
        self.views_ns = [*self.views_ns, stamp_ns] if is_noticeable else []
        if len(self.views_ns) == ONSET_VIEWS:
            self.onset_ns = self.views_ns[0]

    @property
    def was_conscious(self) -> bool:
        """Return whether it was conscious in time."""
        if self.onset_ns is None or self.conscious_ns is None:
            return False
        return self.conscious_ns - self.onset_ns <= CONSCIOUS_WITHIN_S * 1e9


@dataclass(frozen=True)
class Surprises:
    """The surprises of a town, and how often the agent was surprised by nothing."""

    buildings: list[Surprise]
    streets: list[Surprise]
    false: int


def measure(processes: int) -> Metrics:
    """Measure the share of surprises that were conscious in time, over so many towns."""
    seeds = list(range(FIRST_SEED, FIRST_SEED + TOWNS))
    with bar("towns that change") as progress:
        found = parallel_map(surprises_in, seeds, processes, progress)

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
    place = place_of(SimConfig(seed=seed, town="blocks"))
    rng = np.random.default_rng([seed, 0x5E])
    removed = sorted(rng.choice(len(place.plots), REMOVED, replace=False).tolist())
    sections = town_sections(seed)
    sections["sim"]["removals"] = [{"building": each, "from_s": EXPLORE_S} for each in removed]

    judge = Judge(place, removed, rng)
    watching = judge.module("judge", [topics.OFFER, topics.STREET_CLOSURE])
    watching.on(topics.BROADCAST, judge.on_broadcast)
    with running([*build(("sim", *COGNITION), sections), watching]) as runner:
        runner.run(lambda: judge.is_complete)

    return judge.surprises


class Judge(TownObserver):
    """Compares what is conscious with the truth. After the agent has explored it is given the
    buildings that are gone as goals; on the way to each a street is closed.
    """

    def __init__(self, place: Place, removed: list[int], rng: np.random.Generator) -> None:
        super().__init__()
        self.is_complete = False
        self._place = place
        self._visibility = Visibility(place)
        self._removed = removed
        self._rng = rng

        self._has_begun = False
        self._buildings: dict[int, Surprise] = {}
        self._streets: dict[str, Surprise] = {}
        self._false = 0
        self._goals: list[str] = []
        self._goal_until_ns = 0
        self._has_closed = False

    @property
    def surprises(self) -> Surprises:
        """Return the surprises that could be noticed."""
        buildings = [each for each in self._buildings.values() if each.onset_ns is not None]
        streets = [each for each in self._streets.values() if each.onset_ns is not None]
        return Surprises(buildings, streets, self._false)

    def act(self, true: TruePose) -> list[Message]:
        """Note what can be noticed from here, and lead the agent on."""
        if true.stamp_ns < EXPLORE_S * 1e9:
            return []
        if not self._has_begun:
            self._begin()

        at = pose_array(true.pose)
        for number, surprise in self._buildings.items():
            away_m = math.dist(surprise.at_m, (at[0], at[1]))
            is_near = away_m <= NOTICEABLE_M
            surprise.note(true.stamp_ns, is_near and self._visibility.building(at, number))

        for name, surprise in self._streets.items():
            surprise.note(true.stamp_ns, self._visibility.barrier(at, name, NOTICEABLE_M))

        return self._lead(true.stamp_ns)

    def _begin(self) -> None:
        """Give as goals those buildings of the agent's map that are gone from now on."""
        self._has_begun = True
        for number in self._removed:
            plot = self._place.plots[number]
            for node in self.graph.of_kind(Object):
                away_m = math.dist(self._in_truth(node.x_m, node.y_m), (plot.x_m, plot.y_m))
                if node.name == plot.kind.name and away_m <= SAME_M:
                    self._buildings[number] = Surprise((plot.x_m, plot.y_m))
                    self._goals.append(node.label)
                    break

    def on_broadcast(self, broadcast: Broadcast) -> None:
        """Note the surprises that are conscious."""
        if broadcast.coalition.codelet != expectation.NAME or not self._has_begun:
            return

        for node in broadcast.coalition.nodes:
            if isinstance(node, Object):
                at_m = self._in_truth(node.x_m, node.y_m)
                kind = node.name
                gone = [
                    surprise
                    for number, surprise in self._buildings.items()
                    if self._place.plots[number].kind.name == kind
                ]
                self._note_conscious(gone, at_m, SAME_M, broadcast.stamp_ns)

        for link in broadcast.coalition.links:
            cell = place_cell(link.target)
            if link.kind == LinkKind.BLOCKED and cell is not None:
                map_id, i, j = cell
                cell_m = self.graph.cell_m(map_id)
                at_m = self._in_truth(i * cell_m, j * cell_m)
                closed = list(self._streets.values())
                self._note_conscious(closed, at_m, SAME_BARRIER_M, broadcast.stamp_ns)

    def _note_conscious(
        self, surprises: list[Surprise], at_m: Point, within_m: float, stamp_ns: int
    ) -> None:
        """Note that the first of some surprises within a distance is conscious, or a false one."""
        for surprise in surprises:
            if math.dist(at_m, surprise.at_m) <= within_m:
                if surprise.conscious_ns is None:
                    surprise.conscious_ns = stamp_ns
                return

        self._false += 1

    def _lead(self, stamp_ns: int) -> list[Message]:
        """Give the agent the next goal if it is at this one, or has had it for long enough."""
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
        """Close a street of the route to the goal, if one can be."""
        plan = self.graph.get(Plan, PLAN_ID)
        if plan is None or plan.route is None or goal not in plan.goals or self.town is None:
            return []

        self._has_closed = True
        route_m = self.to_truth(np.asarray(plan.route.numpy(), np.float64))
        goal_x_m, goal_y_m = route_m[-1].tolist()
        closure = street_to_close(self._rng, self.town, route_m, (goal_x_m, goal_y_m))
        if closure is None or closure.street in self._streets:
            return []

        (street,) = [each for each in self.town.streets if each.name == closure.street][:1]
        middle_m = np.asarray(barrier_m(street), np.float64).mean(axis=0).tolist()
        self._streets[closure.street] = Surprise((middle_m[0], middle_m[1]))
        return [StreetClosure(street=closure.street, closed=True)]

    def _in_truth(self, x_m: float, y_m: float) -> Point:
        """Transform a position of the agent's map to the true frame."""
        true_x_m, true_y_m = self.to_truth(np.array([[x_m, y_m]]))[0].tolist()
        return true_x_m, true_y_m


def _share(surprises: list[Surprise]) -> float:
    if not surprises:
        return math.nan
    return float(np.mean([each.was_conscious for each in surprises]))
