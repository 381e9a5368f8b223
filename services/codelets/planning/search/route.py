"""Routes over place nodes, and why there is none."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Indices
from cogmap.services.codelets.planning.network import Cell
from cogmap.services.codelets.planning.search.links import Links


class NoRouteReason(enum.StrEnum):
    """Why there is no route."""

    START_OUTSIDE = "the start is outside the map"
    GOAL_OUTSIDE = "the goal is outside the map"
    START_BLOCKED = "the start is on a blocked place"
    GOAL_BLOCKED = "the goal is on a blocked place"
    AT_GOAL = "the start is the goal"
    NOT_CONNECTED = "no traversable links connect the start with the goal"


@dataclass(frozen=True)
class Route:
    """A route over place nodes: (n, 2) cells of the map, from start to goal.

    `cost_m` is the sum of its links' lengths, each over the link's weight.
    """

    cells: Indices
    cell_m: float
    cost_m: float

    @property
    def length_m(self) -> float:
        """The length along the links."""
        steps = np.diff(self.cells, axis=0)
        i, j = steps.T
        lengths = np.hypot(i, j)

        total = float(lengths.sum())
        return self.cell_m * total


@dataclass(frozen=True)
class NoRoute:
    """There is no route, and why."""

    reason: NoRouteReason


def refusal(links: Links, start: Cell, goal: Cell) -> NoRoute | None:
    """Why there is no route, where start and goal alone show it."""
    if not links.contain(start):
        return NoRoute(NoRouteReason.START_OUTSIDE)
    if not links.contain(goal):
        return NoRoute(NoRouteReason.GOAL_OUTSIDE)
    if start == goal:
        return NoRoute(NoRouteReason.AT_GOAL)
    if not links.is_linked[links.node(start)]:
        return NoRoute(NoRouteReason.START_BLOCKED)
    if not links.is_linked[links.node(goal)]:
        return NoRoute(NoRouteReason.GOAL_BLOCKED)
    return None
