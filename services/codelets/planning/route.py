"""Routes over place nodes, and why there is none."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Indices
from services.codelets.planning.links import Links
from services.codelets.planning.network import Cell


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

    `cost_m` is the sum of its links' lengths over their weights.
    """

    cells: Indices
    cell_m: float
    cost_m: float

    @property
    def length_m(self) -> float:
        """The length along the links."""
        steps = np.diff(self.cells, axis=0)
        return self.cell_m * float(np.hypot(*steps.T).sum())


@dataclass(frozen=True)
class NoRoute:
    """There is no route, and why."""

    reason: NoRouteReason


def refusal(links: Links, start: Cell, goal: Cell) -> NoRoute | None:
    """Why there is no route, where start and goal alone show it."""
    if not _is_inside(links, start):
        return NoRoute(NoRouteReason.START_OUTSIDE)
    if not _is_inside(links, goal):
        return NoRoute(NoRouteReason.GOAL_OUTSIDE)
    if start == goal:
        return NoRoute(NoRouteReason.AT_GOAL)

    if not links.is_linked[links.node(start)]:
        return NoRoute(NoRouteReason.START_BLOCKED)
    if not links.is_linked[links.node(goal)]:
        return NoRoute(NoRouteReason.GOAL_BLOCKED)
    return None


def route_along(links: Links, nodes: Indices, cost_m: float) -> Route:
    """The route along (n,) nodes, each linked to the next."""
    return Route(links.cells(nodes), links.cell_m, cost_m)


def _is_inside(links: Links, cell: Cell) -> bool:
    width, height = links.shape
    i = cell[0] - links.origin[0]
    j = cell[1] - links.origin[1]
    return 0 <= i < width and 0 <= j < height
