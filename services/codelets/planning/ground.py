"""The ground around the agent, by what is on the map and where it drove."""

from __future__ import annotations

import math
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
from cogmap.schemas.nodes import PathColumn, PlaceColumn, Self
from cogmap.services.codelets.planning.network import EIGHT, PlaceGrid, ends, with_beside

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *WEIGHT_COLUMNS)
POSITION = slice(PathColumn.X_M, PathColumn.Y_M + 1)

BESIDE_PATH_M = 1.0
"""To each side of its path the robot has driven over the ground: it is 2 m wide at most."""

ROAD_BESIDE_PATH_M = 1.5
"""To each side of the path the ground counts as road: the robot's half width and half a place."""

VISITED_M = 3.0
"""To each side of the path everything was seen from as near as can be: half a street's width."""

START_M = 3.0
"""Within so far of its start the agent looked round."""

BLIND_M = 4.5
"""Ahead of the agent, up to which its camera sees no ground: by the camera's height and angle."""

BLIND_STEP_M = 0.5
"""Between points of the blind ground: less than a place."""

ROAD_BEYOND_M = 2.0
"""Behind the blind ground, where road must begin for it to be known: two places."""

NEAR_M = 6.0
"""From so near the agent sees for sure whether blocked road is free again."""

# So far ahead, and to each side of that line, an agent looks at the ground: less than the scan
# reaches, in a street's width.
LOOK_M = 20.0
LOOK_BESIDE_M = 4.0

LOOK_TAKES_S = 10.0
"""While the agent looks for so long it does not know yet whether what was there has gone."""

CAME_S = 60.0
"""Where the agent drove so lately it can drive back, whatever stands there by now."""

PART_FROM = 0.2
"""A place that is this much an obstacle may be a part of a larger one."""

GROUP_FROM = 3 * OBSTACLE_FROM
"""Of the sum over connected places, from which on they are an obstacle together: as much as three
places are that count by themselves."""


class Ground(NamedTuple):
    """What is known of the places of a rectangle: the map's columns there, the (n, k) rows of the
    agent's path, and where it is.
    """

    window: Window
    grid: PlaceGrid
    path: Floats
    agent: Self

    @classmethod
    def of(cls, graph: Graph, agent: Self, extent: Extent) -> Ground:
        """Read the ground of the agent's map within an extent."""
        window = graph.places.window(agent.map, COLUMNS, extent)
        grid = PlaceGrid(window.origin, window.shape, graph.cell_m(agent.map))
        return cls(window, grid, rows_of(graph.path), agent)

    def is_known(self) -> Booleans:
        """Mark what was seen as road, or driven over, (w, h).

        The ground just ahead, which the camera does not see, counts as known if road begins behind
        it, and where the agent starts.
        """
        agent = self.agent
        is_road: Booleans = self.window.column(PlaceColumn.ROAD) >= ROAD_FROM
        direction = np.array([math.cos(agent.heading_rad), math.sin(agent.heading_rad)])
        distance_m = np.arange(0.0, BLIND_M + ROAD_BEYOND_M, BLIND_STEP_M)
        ahead_m = self.here_m + distance_m[:, None] * direction

        is_blind = distance_m < BLIND_M
        driven_m = self.path[:, POSITION]
        if not len(since_start(self.path)) or self.grid.at(ahead_m[~is_blind], is_road).any():
            driven_m = np.vstack([driven_m, ahead_m[is_blind]])
        return is_road | self.grid.is_within(ROAD_BESIDE_PATH_M, driven_m)

    def is_obstacle(self) -> Booleans:
        """Mark where something stands, (w, h)."""
        return is_obstructed(self.window.column(PlaceColumn.OBSTACLE))

    def is_cut(self) -> Booleans:
        """Mark the places with a link that is cut, (w, h)."""
        is_cut = np.zeros(self.grid.shape, bool)
        for of_link, offset in zip(self.window.weights(), LINK_OFFSETS.tolist(), strict=True):
            here, there = ends(self.grid.shape, offset)
            is_cut[here] |= of_link[here] < CUT_BELOW
            is_cut[there] |= of_link[here] < CUT_BELOW
        return is_cut

    def is_driven_over(self, is_obstacle: Booleans) -> Booleans:
        """Mark the places that the robot drove over, (w, h), so that an edge mapped there is a
        mistake, or a kerb that it can cross; not gaps between obstacles that are no wider than a
        place.
        """
        is_gap = ~with_beside(~with_beside(is_obstacle))
        is_driven = self.grid.is_within(BESIDE_PATH_M, self.path[:, POSITION])
        is_driven &= ~is_gap & ~is_obstacle
        return is_driven

    def is_return(self, is_obstacle: Booleans) -> Booleans:
        """Mark the places of the path and those beside, (w, h), if nothing stands there; and those
        where the agent was a moment ago, for there nothing stands, whatever it saw.
        """
        whole = self.grid.has(np.vstack([self.path[:, POSITION], self.here_m]))
        late = self.grid.has(self.since_m(PathColumn.STAMP_S, CAME_S))
        beside = with_beside(whole) & ~is_obstacle
        return np.asarray(beside | late)

    def is_visited(self) -> Booleans:
        """Mark what was seen from as near as can be, (w, h)."""
        return self.grid.is_within(VISITED_M, since_start(self.path)[:, POSITION])

    def is_seen_near(self, since_s: float) -> Booleans:
        """Mark what the agent was near enough to see for sure in the last `since_s`, (w, h)."""
        return self.grid.is_within(NEAR_M, self.since_m(PathColumn.LAST_S, since_s))

    def looked_ago_s(self, since_s: float) -> Singles:
        """Return how long ago the agent looked at each place (w, h) from within LOOK_M; infinite if
        that was not within the last `since_s`.
        """
        ago_s = self.agent.stamp_ns * 1e-9 - self.path[:, PathColumn.LAST_S]
        is_late = (ago_s >= LOOK_TAKES_S) & (ago_s <= since_s)
        rows = self.path[is_late]

        distance_m = np.arange(0.0, LOOK_M + self.grid.cell_m, self.grid.cell_m)
        heading_rad = rows[:, PathColumn.HEADING_RAD, None]
        x_m = rows[:, PathColumn.X_M, None] + distance_m * np.cos(heading_rad)
        y_m = rows[:, PathColumn.Y_M, None] + distance_m * np.sin(heading_rad)
        positions_m = np.stack([x_m, y_m], axis=-1).reshape(-1, 2)

        lately_s = self.grid.minimum(positions_m, np.repeat(ago_s[is_late], len(distance_m)))
        side = 2 * round(LOOK_BESIDE_M / self.grid.cell_m) + 1
        ago_beside_s: Singles = ndimage.minimum_filter(lately_s, side, mode="constant", cval=np.inf)
        return ago_beside_s

    @property
    def here_m(self) -> Floats:
        """Return where the agent is, (1, 2)."""
        return np.array([[self.agent.x_m, self.agent.y_m]])

    def since_m(self, column: PathColumn, since_s: float) -> Floats:
        """Return where the agent is, and was in the last `since_s` by a column of its path."""
        is_late = self.path[:, column] >= self.agent.stamp_ns * 1e-9 - since_s
        return np.vstack([self.path[is_late][:, POSITION], self.here_m])


def is_obstructed(obstacle: Singles) -> Booleans:
    """Mark where something stands, (w, h), by how much each place is an obstacle.

    From far a thing is seen now in a place, now in the one behind it, so that none reaches
    OBSTACLE_FROM at first, or a part of them does. Connected places from PART_FROM on count
    together.
    """
    groups, number = ndimage.label(obstacle >= PART_FROM, EIGHT)
    total = np.bincount(groups.ravel(), obstacle.ravel(), minlength=number + 1)
    is_whole = total >= GROUP_FROM
    is_whole[0] = False
    return np.asarray((obstacle >= OBSTACLE_FROM) | is_whole[groups])


def since_start(path: Floats) -> Floats:
    """Return the rows of a path from where it has left its start: from there the agent did not look
    round.
    """
    from_start_m = np.hypot(*(path[:, POSITION] - path[:1, POSITION]).T)
    has_left = from_start_m > START_M
    since: Floats = path[has_left.cumsum() > 0]
    return since
