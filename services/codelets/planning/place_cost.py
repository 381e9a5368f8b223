"""What it costs to drive over the places of a map: layers, each a factor with its reason.

A place is as dear as the product of its layers, so that there is one network to plan on (paper
§5.3: links that a boundary cuts are not crossed). Beyond the paper, road that was blocked may be
free again: it costs much, and the more, the less time has passed since it was looked at.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.graph.window import (
    CUT_BELOW,
    LINK_OFFSETS,
    OBSTACLE_FROM,
    ROAD_FROM,
    WEIGHT_COLUMNS,
    Extent,
    Window,
)
from cogmap.robot import HALF_WIDTH_M
from cogmap.schemas.nodes import CostLayer, Goal, PathColumn, PlaceColumn, Self
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.corridor import Corridor
from cogmap.services.codelets.planning.network import (
    SQUARE,
    PlaceGrid,
    PlaceNetwork,
    ends,
    place_network,
)

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *WEIGHT_COLUMNS)
POSITION = slice(PathColumn.X_M, PathColumn.Y_M + 1)

BESIDE_COST = 2.0
"""Of a place beside a blocked one: it halves the weight, so that a route keeps off kerbs where the
street is wide enough. Chosen on simulated towns."""

BLOCKED_COST = 500.0
"""Of road that was blocked, long after it was looked at: to try a barrier one place wide costs as
much as a way round of 500 m. Chosen on simulated towns, where few barriers go."""

RETURN_COST = 1000.0
"""Of the way back as the agent came, whatever is on the map there by now: what is left if all else
is dearer."""

BESIDE_PATH_M = 1.0
"""To each side of its path the robot has driven over the ground: it is 2 m wide at most."""

ROAD_BESIDE_PATH_M = 1.5
"""To each side of the path the ground counts as road: the robot's half width and half a place."""

VISITED_M = 3.0
"""To each side of the path everything was seen from as near as can be: half a street's width."""

MARGIN_CELLS = 8
"""Unknown places around the map that are planned over: the width of a street."""

BEYOND_CELLS = 100
"""Places outside the map as far as which goals are planned: a block of houses."""

START_M = 3.0
"""Within so far of its start the agent looked round."""

BLIND_M = 4.5
"""Ahead of the agent, up to which its camera sees no ground: by the camera's height and angle."""

BLIND_STEP_M = 0.5
ROAD_BEYOND_M = 2.0

NEAR_M = 6.0
"""From so near the agent sees for sure whether blocked road is free again."""

LOOK_M = 20.0
LOOK_BESIDE_M = 4.0
"""So far ahead, and to each side of that line, an agent looks at the ground: less than the scan
reaches, in a street's width."""

LOOK_TAKES_S = 10.0
"""While the agent looks for so long it does not know yet whether what was there has gone."""

LATEST_LOOK_SHARE = 0.05
"""Of the time after which a street may be open again: looks that are more lately count alike."""

CAME_S = 60.0
"""Where the agent drove so lately it can drive back, whatever stands there by now."""

SPREAD_FROM = 0.2
"""A place that is this much an obstacle is one if places beside it are in part as well."""


class PlaceCosts(NamedTuple):
    """The places of a rectangle of a map, and what it costs to drive over them.

    `layers`: (w, h) factors of at least 1, infinite where a place is blocked. `is_inside` (w, h):
    in the corridor that is planned on. `is_free` (w, h): nothing blocks the place. `is_known`
    (w, h): seen as road, or driven over. `is_return` (w, h): where the agent came from.
    `is_visited` (w, h): seen from as near as can be.
    """

    grid: PlaceGrid
    layers: dict[CostLayer, Floats]
    is_inside: Booleans
    is_free: Booleans
    is_known: Booleans
    is_return: Booleans
    is_visited: Booleans

    @property
    def is_known_free(self) -> Booleans:
        """Mark the places that are known and that nothing blocks, (w, h)."""
        return np.asarray(self.is_known & self.is_free)

    def cost(self) -> Floats:
        """Multiply the layers, (w, h)."""
        product: Floats = np.where(self.is_inside, 1.0, np.inf)
        for factor in self.layers.values():
            product *= factor
        return product

    def network(self) -> PlaceNetwork:
        """Make the place network to plan on."""
        return place_network(self.cost(), self.grid.cell_m, self.grid.origin)

    def known_network(self) -> PlaceNetwork:
        """Make that of places to explore over: known and free, or leading back."""
        is_sure = self.is_known & (self.is_free | self.is_return)
        cost = np.where(is_sure, self.cost(), np.inf)
        return place_network(cost, self.grid.cell_m, self.grid.origin)


def place_costs(
    graph: Graph,
    agent: Self,
    config: Config,
    goals: Sequence[Goal] = (),
    within: Corridor | None = None,
) -> PlaceCosts:
    """Work out the costs of the places of the agent's map, and of some unknown ones around it, as
    far as to those of `goals` that are positions not too far outside; those `within` a corridor, if
    one is given.
    """
    extent = _extent(graph, agent.map, goals, config) if within is None else within.extent
    window = graph.places.window(agent.map, COLUMNS, extent)
    grid = PlaceGrid(window.origin, window.shape, graph.cell_m(agent.map))
    path = rows_of(graph.path)

    is_known = _is_known(window, grid, path, agent)
    is_obstacle = is_obstructed(window.column(PlaceColumn.OBSTACLE))
    is_driven = _is_driven_over(grid, path, is_obstacle)
    is_edge = _has_cut(window.weights()) & ~is_driven & ~is_obstacle
    is_narrow = _is_narrow(is_edge | is_obstacle, grid.cell_m) & ~is_driven
    is_blocked = is_edge | is_obstacle | is_narrow
    is_return = _is_return(grid, path, agent, is_obstacle)

    blocked_cost = np.where(is_known, BLOCKED_COST, np.inf)
    blocked_cost[is_return] = RETURN_COST
    seen_cost = _seen_cost(grid, path, agent, config)
    seen_cost[is_return] = 1.0

    is_beside = ndimage.binary_dilation(is_blocked, SQUARE) & ~is_blocked
    layers = {
        CostLayer.UNKNOWN: np.where(is_known, 1.0, config.unknown_cost),
        CostLayer.EDGE: np.where(is_edge, blocked_cost, 1.0),
        CostLayer.OBSTACLE: np.where(is_obstacle, blocked_cost, 1.0),
        CostLayer.NARROW: np.where(is_narrow, blocked_cost, 1.0),
        CostLayer.SEEN_LATELY: np.where(is_blocked, seen_cost, 1.0),
        CostLayer.BESIDE: np.where(is_beside, BESIDE_COST, 1.0),
    }
    return PlaceCosts(
        grid=grid,
        layers=layers,
        is_inside=np.ones(grid.shape, bool) if within is None else within.is_inside,
        is_free=~is_blocked,
        is_known=is_known,
        is_return=is_return,
        is_visited=grid.is_within(VISITED_M, since_start(path)[:, POSITION]),
    )


def is_obstructed(obstacle: Singles) -> Booleans:
    """Mark where something stands, (w, h), by how much each place is an obstacle.

    From far a thing is seen now in a place, now in the one behind it, so that none reaches
    OBSTACLE_FROM. One counts that is SPREAD_FROM, if the nine places around it are as much obstacle
    as three of them would be that reach it.
    """
    around = ndimage.uniform_filter(obstacle, 3, mode="constant") * SQUARE.size
    is_spread = (obstacle >= SPREAD_FROM) & (around >= 3 * OBSTACLE_FROM)
    return np.asarray((obstacle >= OBSTACLE_FROM) | is_spread)


def since_start(path: Floats) -> Floats:
    """Return the rows of a path from where it has left its start: from there the agent did not look
    round.
    """
    from_start_m = np.hypot(*(path[:, POSITION] - path[:1, POSITION]).T)
    has_left = from_start_m > START_M
    since: Floats = path[has_left.cumsum() > 0]
    return since


def looked_ago_s(path: Floats, agent: Self, since_s: float, grid: PlaceGrid) -> Floats:
    """Return how long ago the agent looked at each place (w, h) from within LOOK_M, by the (n, k)
    rows of its path; infinite if that was not within the last `since_s`.
    """
    ago_s = agent.stamp_ns * 1e-9 - path[:, PathColumn.LAST_S]
    is_late = (ago_s >= LOOK_TAKES_S) & (ago_s <= since_s)
    rows = path[is_late]

    distance_m = np.arange(0.0, LOOK_M + grid.cell_m, grid.cell_m)
    heading_rad = rows[:, PathColumn.HEADING_RAD, None]
    x_m = rows[:, PathColumn.X_M, None] + distance_m * np.cos(heading_rad)
    y_m = rows[:, PathColumn.Y_M, None] + distance_m * np.sin(heading_rad)
    positions_m = np.stack([x_m, y_m], axis=-1).reshape(-1, 2)

    lately = grid.minimum(positions_m, np.repeat(ago_s[is_late], len(distance_m)))
    side = 2 * round(LOOK_BESIDE_M / grid.cell_m) + 1
    minimum_s: Floats = ndimage.minimum_filter(lately, side, mode="constant", cval=np.inf)
    return minimum_s


def _extent(graph: Graph, map_id: str, goals: Sequence[Goal], config: Config) -> Extent:
    """Return the rectangle of place nodes that is planned on: the map, and goals that are positions
    at most BEYOND_CELLS outside.
    """
    extent = graph.places.extent(map_id)
    lower = np.array(extent.lower)
    upper = np.array(extent.upper)
    positions_m = [(goal.x_m, goal.y_m) for goal in goals if not goal.object]
    cells = np.rint(np.array(positions_m).reshape(-1, 2) / graph.cell_m(map_id)).astype(np.int64)
    is_near = ((cells >= lower - BEYOND_CELLS) & (cells < upper + BEYOND_CELLS)).all(axis=1)

    first_i, first_j = np.vstack([lower, cells[is_near]]).min(axis=0).tolist()
    last_i, last_j = np.vstack([upper, cells[is_near] + 1]).max(axis=0).tolist()
    return Extent((first_i, first_j), (last_i, last_j)).grown(MARGIN_CELLS)


def _is_known(window: Window, grid: PlaceGrid, path: Floats, agent: Self) -> Booleans:
    """Mark what was seen as road, or driven over, (w, h). The ground just ahead, which the camera
    does not see, counts as known if road begins behind it, and where the agent starts.
    """
    is_road: Booleans = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    direction = np.array([math.cos(agent.heading_rad), math.sin(agent.heading_rad)])
    distance_m = np.arange(0.0, BLIND_M + ROAD_BEYOND_M, BLIND_STEP_M)
    ahead_m = np.array([agent.x_m, agent.y_m]) + distance_m[:, None] * direction

    is_blind = distance_m < BLIND_M
    driven_m = path[:, POSITION]
    if not len(since_start(path)) or grid.at(ahead_m[~is_blind], is_road).any():
        driven_m = np.vstack([driven_m, ahead_m[is_blind]])
    return is_road | grid.is_within(ROAD_BESIDE_PATH_M, driven_m)


def _has_cut(weights: Singles) -> Booleans:
    """Mark the places with a link that is cut, (w, h)."""
    _, width, height = weights.shape
    has_cut = np.zeros((width, height), bool)
    for of_link, offset in zip(weights, LINK_OFFSETS.tolist(), strict=True):
        here, there = ends((width, height), offset)
        is_cut = of_link[here] < CUT_BELOW
        has_cut[here] |= is_cut
        has_cut[there] |= is_cut

    return has_cut


def _is_narrow(is_blocked: Booleans, cell_m: float) -> Booleans:
    """Mark the free places (w, h) between two blocked ones, if the robot is wider than a place."""
    if cell_m >= 2 * HALF_WIDTH_M:
        return np.zeros_like(is_blocked)

    around = np.pad(is_blocked, 1)
    width, height = is_blocked.shape
    is_between = np.zeros_like(is_blocked)
    for di, dj in LINK_OFFSETS.tolist():
        one = around[1 + di : 1 + di + width, 1 + dj : 1 + dj + height]
        other = around[1 - di : 1 - di + width, 1 - dj : 1 - dj + height]
        is_between |= one & other

    is_between &= ~is_blocked
    return is_between


def _is_driven_over(grid: PlaceGrid, path: Floats, is_obstacle: Booleans) -> Booleans:
    """Mark the places that the robot drove over, (w, h), so that an edge mapped there is a mistake,
    or a kerb that it can cross; gaps between obstacles that are no wider than a place do not count.
    """
    is_gap = ndimage.binary_closing(is_obstacle, SQUARE)
    is_driven = grid.is_within(BESIDE_PATH_M, path[:, POSITION])
    is_driven &= ~is_gap & ~is_obstacle
    return is_driven


def _is_return(grid: PlaceGrid, path: Floats, agent: Self, is_obstacle: Booleans) -> Booleans:
    """Mark the places of the path and those beside, (w, h), if nothing stands there; and those
    where it was a moment ago, for there nothing stands, whatever it saw.
    """
    here_m = np.array([[agent.x_m, agent.y_m]])
    is_late = path[:, PathColumn.STAMP_S] >= agent.stamp_ns * 1e-9 - CAME_S

    whole = grid.has(np.vstack([path[:, POSITION], here_m]))
    late = grid.has(np.vstack([path[is_late][:, POSITION], here_m]))
    beside = ndimage.binary_dilation(whole, SQUARE) & ~is_obstacle
    return np.asarray(beside | late)


def _seen_cost(grid: PlaceGrid, path: Floats, agent: Self, config: Config) -> Floats:
    """Return the factor (w, h) on the cost of blocked road, by how long ago the agent looked at it:
    infinite if it was so near that it would have seen it free.
    """
    after_s = config.reopens_after_s
    ago_s = looked_ago_s(path, agent, after_s, grid)
    cost = 1 / (ago_s / after_s).clip(LATEST_LOOK_SHARE, 1.0)

    is_late = path[:, PathColumn.LAST_S] >= agent.stamp_ns * 1e-9 - after_s
    here_m = np.array([[agent.x_m, agent.y_m]])
    cost[grid.is_within(NEAR_M, np.vstack([path[is_late][:, POSITION], here_m]))] = np.inf
    return cost
