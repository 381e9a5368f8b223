"""Routes by activation that spreads from the goal over place nodes (paper §5.5).

A link passes on exp(-2x) of the activation that it receives, x its cost in cells, so the logarithm
of a node's activation is minus its distance from the goal. Distances are what is computed: nothing
underflows, however far the goal. The route climbs from node to neighbour up the activation.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from cogmap.geometry.arrays import Floats, Indices
from services.codelets.planning.links import link_costs_m, link_matrix
from services.codelets.planning.network import (
    LINK_OFFSETS,
    NEIGHBOUR_OFFSETS,
    Cell,
    PlaceNetwork,
)

DECAY_PER_CELL = 2.0


@dataclass(frozen=True)
class Field:
    """Activation over the nodes of a network.

    `distance_m`: (width, height), the cost of the cheapest route to the nearest goal, inf where no
    activation arrives.
    """

    origin: Cell
    cell_m: float
    distance_m: Floats

    @property
    def log_activation(self) -> Floats:
        """(width, height): the logarithm of the activation, which is 1 at a goal."""
        log: Floats = -DECAY_PER_CELL * self.distance_m / self.cell_m
        return log

    @property
    def activation(self) -> Floats:
        """(width, height): the activation, 0 where none arrives, or too little to represent."""
        return np.exp(self.log_activation)


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

    `length_m` is measured along its links, `cost_m` is that with each link's length over its weight.
    """

    cells: Indices
    length_m: float
    cost_m: float


@dataclass(frozen=True)
class NoRoute:
    """There is no route, and why."""

    reason: NoRouteReason


def spread(network: PlaceNetwork, goals: Indices) -> Field:
    """The activation that spreads from `goals`, (k, 2) cells of the map; those outside are ignored."""
    sources = [network.index_of((i, j)) for i, j in goals.tolist() if network.contains((i, j))]
    distance_m = np.full(network.shape, np.inf)

    if sources:
        nodes = np.ravel_multi_index(np.transpose(sources), network.shape)
        found = dijkstra(link_matrix(network), indices=nodes, min_only=True)
        distance_m = found.reshape(network.shape)

    return Field(network.origin, network.cell_m, distance_m)


def climb(network: PlaceNetwork, field: Field, start: Cell) -> Indices | None:
    """(n, 2) cells from `start` to the goal, each the neighbour through which most activation came.

    Of equal ones the first in the order of NEIGHBOUR_OFFSETS is taken. None where no activation
    arrives at the start.
    """
    if not network.contains(start):
        return None

    cell = network.index_of(start)
    if not np.isfinite(field.distance_m[cell]):
        return None

    costs_m = _padded_costs(network)
    distances_m = np.pad(field.distance_m, 1, constant_values=np.inf)
    indices = [cell]
    while field.distance_m[cell] > 0:
        cell = _next(costs_m, distances_m, cell)
        indices.append(cell)

    cells: Indices = np.array(indices) + np.array(network.origin)
    return cells


def _next(costs_m: Floats, distances_m: Floats, cell: Cell) -> Cell:
    """The neighbour on the cheapest route; arrays are padded by one cell on each side."""
    i, j = np.array(cell) + 1
    here = np.array([i, j])
    neighbours_i, neighbours_j = (here + NEIGHBOUR_OFFSETS).T

    forward = costs_m[:, i, j]
    before_i, before_j = (here - LINK_OFFSETS).T
    backward = costs_m[np.arange(len(LINK_OFFSETS)), before_i, before_j]
    through_m = distances_m[neighbours_i, neighbours_j] + np.concatenate([forward, backward])

    best = through_m.argmin()
    di, dj = NEIGHBOUR_OFFSETS[best].tolist()
    return cell[0] + di, cell[1] + dj


def _padded_costs(network: PlaceNetwork) -> Floats:
    return np.pad(link_costs_m(network), ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)


def find_route(network: PlaceNetwork, start: Cell, goal: Cell) -> Route | NoRoute:
    """The cheapest route between two cells of the map, or the reason why there is none."""
    reason = _obstacle(network, start, goal)
    if reason is not None:
        return NoRoute(reason)

    field = spread(network, np.array([goal]))
    cells = climb(network, field, start)
    if cells is None:
        return NoRoute(NoRouteReason.NOT_CONNECTED)

    return Route(cells, route_length_m(cells, network.cell_m), _at(field, network, start))


def route_length_m(cells: Indices, cell_m: float) -> float:
    """The length of a route along its links, (n, 2) cells."""
    steps = np.diff(cells, axis=0)
    return cell_m * float(np.hypot(*steps.T).sum())


def _at(field: Field, network: PlaceNetwork, cell: Cell) -> float:
    return float(field.distance_m[network.index_of(cell)])


def _obstacle(network: PlaceNetwork, start: Cell, goal: Cell) -> NoRouteReason | None:
    """Why there can be no route, as far as start and goal alone show it."""
    if not network.contains(start):
        return NoRouteReason.START_OUTSIDE
    if not network.contains(goal):
        return NoRouteReason.GOAL_OUTSIDE
    if start == goal:
        return NoRouteReason.AT_GOAL
    if _is_blocked(network, start):
        return NoRouteReason.START_BLOCKED
    if _is_blocked(network, goal):
        return NoRouteReason.GOAL_BLOCKED
    return None


def _is_blocked(network: PlaceNetwork, cell: Cell) -> bool:
    """Whether every link of a cell is cut."""
    i, j = network.index_of(cell)
    forward = network.weights[:, i, j]
    if forward.any():
        return False

    width, height = network.shape
    for link, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        before_i = i - di
        before_j = j - dj
        is_inside = 0 <= before_i < width and 0 <= before_j < height
        if is_inside and network.weights[link, before_i, before_j] > 0:
            return False

    return True
