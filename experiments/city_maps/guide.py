"""A guide who knows the city: gives the agent the turns of a tour as goals, one after another, as
the paper's agent was given its turns (§6.2).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.experiments import reading
from cogmap.experiments.city_maps.streets import Points
from cogmap.geometry.polylines import distances_along, interpolate, nearest_on_line
from cogmap.geometry.se2 import transform_from, transform_to
from cogmap.graph.graph import Graph
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.codelets import Offer
from cogmap.schemas.graph import Delta, DropNode, Operation, Phase
from cogmap.schemas.nodes import Goal, goal_id
from cogmap.schemas.sensing import TruePose
from cogmap.services.sim.layout.plan import STREET_WIDTH_M

ARRIVED_M = STREET_WIDTH_M
"""Of a goal within which the robot truly is there."""

POINTED_M = 3.0
"""The goal is given anew if the agent has it farther from where it truly is. With the distance at
which the agent takes a goal for reached, REACHED_M, it is less than ARRIVED_M: nobody waits.
"""

REACHED_M = 3.0
"""At which the agent itself takes a goal for reached."""

BEND_M = 4.0
"""A bend of the tour that leaves the straight line by less, half a street's width, is no turn."""

SHOWN_M = 60.0
"""A goal is no farther ahead along the tour than the agent can see."""


class Stops(NamedTuple):
    """The (n, 2) places of a tour that are goals in turn, how far along the tour each is, (n,), and
    whether it is where a building is passed, (n,).
    """

    places_m: Points
    along_m: Points
    is_building: list[bool]


def stops(line_m: Points, buildings_m: Points) -> Stops:
    """Return the stops of a tour, a line (n, 2), past (k, 2) buildings: its turns, where each
    building is passed, and places between, SHOWN_M apart at most; its first point is none.
    """
    along_m = distances_along(line_m)
    contour = line_m.astype(np.float32)[:, None]
    turns_m = cv2.approxPolyDP(contour, BEND_M, closed=False)[:, 0]
    is_turn = (np.abs(line_m[:, None] - turns_m).max(axis=2) < 1e-2).any(axis=1)

    # A building is passed at the first point of the tour that is as near to it as any.
    passed_m = nearest_on_line(line_m, buildings_m)
    start_m = line_m[passed_m.piece]
    building_along_m = along_m[passed_m.piece] + np.hypot(*(passed_m.foot_m - start_m).T)

    given_m = np.unique(np.concatenate([along_m[is_turn], building_along_m]).round(3))
    between_m = []
    for from_m, to_m in pairwise(given_m.tolist()):
        parts = math.ceil((to_m - from_m) / SHOWN_M)
        between_m.append(np.linspace(from_m, to_m, parts + 1)[1:])

    stop_along_m = np.concatenate(between_m)
    at_building = np.abs(stop_along_m[:, None] - building_along_m) < 1e-2
    return Stops(
        interpolate(along_m, line_m, stop_along_m), stop_along_m, at_building.any(axis=1).tolist()
    )


class Outcome(NamedTuple):
    """How a drive ended: stops and buildings reached and given, metres driven, those of the tour to
    the last stop that was reached, whether the agent took itself for lost, and simulated seconds.
    """

    stops: int
    stops_given: int
    buildings: int
    buildings_given: int
    driven_m: float
    tour_m: float
    is_lost: bool
    duration_s: float

    @property
    def is_finished(self) -> bool:
        """Return whether every stop was reached."""
        return self.stops == self.stops_given


class Guide:
    """Shows the agent the next stop from where the robot stands, as a person beside it would: how
    far ahead and how far to the left it is. Offers it as a goal on the agent's own map, and again
    if the agent has come to have it elsewhere.

    The truth reaches no module but as such a goal. The drive is over once every stop is reached, or
    after `limit_s`.
    """

    def __init__(self, stops: Stops, limit_s: float) -> None:
        self._stops = stops
        self._limit_s = limit_s
        self._graph = Graph(with_places=False)
        self._true: TruePose | None = None
        self._reached = 0
        self._given = ""

    def module(self) -> Module:
        """Build the module `guide`."""
        module = Module("guide")
        module.on(topics.TRUE_POSE, self.on_pose)
        return module.following(self._graph, self.on_delta, emits=[topics.OFFER])

    @property
    def is_over(self) -> bool:
        """Return whether the tour has ended, by its last stop or by time."""
        true = self._true
        is_late = true is not None and true.stamp_ns >= self._limit_s * 1e9
        return is_late or self._reached == len(self._stops.along_m)

    def outcome(self) -> Outcome:
        """Return how the drive ended."""
        reached = self._reached
        true = self._true
        agent = self._graph.agent
        return Outcome(
            stops=reached,
            stops_given=len(self._stops.along_m),
            buildings=sum(self._stops.is_building[:reached]),
            buildings_given=sum(self._stops.is_building),
            driven_m=0.0 if true is None else true.travelled_m,
            tour_m=float(self._stops.along_m[reached - 1]) if reached else 0.0,
            is_lost=agent is not None and agent.misfits.is_lost,
            duration_s=0.0 if true is None else true.stamp_ns * 1e-9,
        )

    def on_pose(self, true: TruePose) -> None:
        """Note where the robot is, and the stops that it has come to."""
        self._true = true
        at_m = np.array([true.pose.x_m, true.pose.y_m])

        while self._reached < len(self._stops.along_m):
            away_m = np.hypot(*(self._stops.places_m[self._reached] - at_m))
            if away_m > ARRIVED_M:
                break
            self._reached += 1

    def on_delta(self, delta: Delta) -> list[Message]:
        """Show the next stop once the agent knows where it takes itself to be."""
        true = self._true
        agent = self._graph.agent
        if delta.phase is not Phase.LOCALIZATION or true is None or agent is None or self.is_over:
            return []

        pose = np.array([true.pose.x_m, true.pose.y_m, true.pose.heading_rad])
        seen_m = transform_to(pose, self._stops.places_m[None, self._reached])
        believed = np.array(reading.self_pose(self._graph))
        ((x_m, y_m),) = transform_from(believed, seen_m).tolist()

        name = goal_id(f"stop {self._reached + 1}")
        known = self._graph.get(Goal, name)
        if known is not None and np.hypot(known.x_m - x_m, known.y_m - y_m) <= POINTED_M:
            return []

        operations: list[Operation] = []
        if self._given not in {"", name} and self._graph.get(Goal, self._given) is not None:
            operations.append(DropNode(id=self._given))
        operations.append(Goal(id=name, base_level=1.0, map=agent.map, x_m=x_m, y_m=y_m))
        self._given = name
        return [Offer(cycle=self._graph.cycle, stamp_ns=delta.stamp_ns, operations=operations)]
