"""The ground that the agent may drive over: place nodes and links of a map, as planners need them.

Links that a boundary cuts are not crossed (paper §5.3). Beyond the paper, place nodes beside a cut
link or an obstacle are avoided by the robot's width, and those that were never seen as road cost
more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS, ROAD_FROM, WEIGHT_COLUMNS, Extent
from schemas.nodes import Goal, PathColumn, PathSegment, PlaceColumn, Self
from services.codelets.planning.config import Config
from services.codelets.planning.network import PlaceNetwork

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *WEIGHT_COLUMNS)
OBSTACLE_FROM = 0.5
SPREAD_FROM = 0.2
BESIDE_CUT = 0.5
BLIND_STEP_M = 0.5
LEFT_START_M = 3.0
# Where the agent drove so lately it can drive back, whatever stands there by now.
CAME_S = 60.0
ROAD_BEYOND_M = 2.0
POSITION = slice(PathColumn.X_M, PathColumn.Y_M + 1)
SQUARE = np.ones((3, 3), bool)

Slices = tuple[slice, slice]


class Ground(NamedTuple):
    """The place nodes of one map within a rectangle.

    `is_free` (w, h): the robot fits there. `is_known` (w, h): seen as road, or driven over.
    `is_visited` (w, h): beside the path, seen from as near as can be. `network` has links between
    free places, lighter where unknown; `known` has those between known places only. `doubted` has
    those of `network`, and the lightest where road is blocked that was not seen from near lately:
    it may be free again; so is the way by which the agent has come just now.
    """

    is_free: Booleans
    is_known: Booleans
    is_visited: Booleans
    network: PlaceNetwork
    known: PlaceNetwork
    doubted: PlaceNetwork


def ground(graph: Graph, agent: Self, config: Config, goals: Sequence[Goal] = ()) -> Ground:
    """The ground of the agent's map and some unknown places around it, as far as to those of
    `goals` that are positions not too far outside.

    The path that the agent took counts as known, and so does ground ahead that is too near for its
    camera, where road begins behind it.
    """
    map_id = agent.map
    extent = graph.places.extent(map_id)
    extent = _with_goals(extent, goals, graph.cell_m(map_id), config.beyond_cells)
    extent = _with_margin(extent, config.margin_cells)
    window = graph.places.window(map_id, COLUMNS, extent)
    weights = window.weights()

    here = Here(window.origin, window.shape, graph.cell_m(map_id))
    path = _path(graph)
    path_m = path[:, POSITION]
    is_seen = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    driven_m = path_m
    if _is_road_ahead(agent, path_m, is_seen, here, config):
        driven_m = np.vstack([path_m, _ahead_m(agent, 0.0, config.blind_m)])
    is_known = is_seen | here.is_within(config.driven_m, driven_m)

    is_obstacle = _stands_there(window.column(PlaceColumn.OBSTACLE))
    is_edge = _has_cut(weights) | is_obstacle
    is_way_back = _way_back(path, agent, is_known & ~is_edge, is_obstacle, here)
    weights = _opened(weights, is_way_back)

    share = _shares(is_edge)
    share[is_way_back & is_edge] = config.doubt_weight
    optimistic = np.where(is_known, share, share * config.unknown_weight)

    lately_m = _lately_m(path, agent, config.doubt_after_s)
    is_seen_lately = here.is_within(config.doubt_from_m, lately_m)
    is_in_doubt = is_known & is_edge & ~is_seen_lately
    in_doubt = np.where(is_in_doubt, config.doubt_weight, optimistic)

    return Ground(
        is_free=~is_edge,
        is_known=is_known & ~is_edge,
        is_visited=here.is_within(config.visited_m, _since_start_m(path_m)),
        network=here.network(_links(weights, optimistic)),
        known=here.network(_links(weights, np.where(is_known, share, 0.0))),
        doubted=here.network(_links(_opened(weights, is_known), in_doubt)),
    )


def _stands_there(obstacle: Singles) -> Booleans:
    """(w, h): where something stands. From far it is seen now in a cell, now in the one behind it:
    all of what was seen there and beside counts, where it would do for a row of three.
    """
    around = ndimage.uniform_filter(obstacle, 3, mode="constant") * SQUARE.size
    is_spread = (obstacle >= SPREAD_FROM) & (around >= 3 * OBSTACLE_FROM)
    return np.asarray((obstacle >= OBSTACLE_FROM) | is_spread)


def _shares(is_edge: Booleans) -> Floats:
    """(w, h): how well each place can be driven over: not at an edge, less beside one."""
    is_beside = ndimage.binary_dilation(is_edge, SQUARE)
    share = np.where(is_beside, BESIDE_CUT, 1.0)
    share[is_edge] = 0.0
    return share


class Here(NamedTuple):
    """The rectangle of place nodes that is planned on."""

    origin: tuple[int, int]
    shape: tuple[int, int]
    cell_m: float

    def network(self, weights: Singles) -> PlaceNetwork:
        """Its place network, with links of (4, w, h) weights."""
        return PlaceNetwork(self.origin, self.cell_m, weights)

    def at(self, positions_m: Floats, values: Booleans) -> Booleans:
        """(n,): the (w, h) values at (n, 2) positions, false outside."""
        cells, is_inside = self._cells(positions_m)
        found = np.zeros(len(positions_m), bool)
        found[is_inside] = values[tuple(cells[is_inside].T)]
        return found

    def has(self, positions_m: Floats) -> Booleans:
        """(w, h): the cells of (n, 2) positions."""
        cells, is_inside = self._cells(positions_m)
        has = np.zeros(self.shape, bool)
        has[tuple(cells[is_inside].T)] = True
        return has

    def is_within(self, within_m: float, positions_m: Floats) -> Booleans:
        """(w, h): the cells within a distance of any of (n, 2) positions."""
        has = self.has(positions_m)
        if not has.any():
            return has

        distance_m = ndimage.distance_transform_edt(~has) * self.cell_m
        return np.asarray(distance_m <= within_m)

    def _cells(self, positions_m: Floats) -> tuple[Indices, Booleans]:
        """(n, 2) and (n,): the indices of positions, and which are inside."""
        cells = np.rint(positions_m / self.cell_m).astype(np.int64) - np.array(self.origin)
        return cells, ((cells >= 0) & (cells < self.shape)).all(axis=1)


def _ahead_m(agent: Self, first_m: float, last_m: float) -> Floats:
    """(n, 2): positions ahead of the agent, at distances from `first_m` to before `last_m`."""
    ahead_m = np.arange(first_m, last_m, BLIND_STEP_M)
    direction = np.array([math.cos(agent.heading_rad), math.sin(agent.heading_rad)])
    positions_m: Floats = np.array([agent.x_m, agent.y_m]) + ahead_m[:, None] * direction
    return positions_m


def _is_road_ahead(
    agent: Self, path_m: Floats, is_road: Booleans, here: Here, config: Config
) -> bool:
    """Whether the ground ahead that the agent's camera does not see is taken for road: where road
    that it sees begins behind it, and where the agent starts. Elsewhere it may be anything.
    """
    if not len(_since_start_m(path_m)):
        return True

    beyond_m = _ahead_m(agent, config.blind_m, config.blind_m + ROAD_BEYOND_M)
    return bool(here.at(beyond_m, is_road).any())


def _way_back(
    path: Floats, agent: Self, is_ground: Booleans, is_obstacle: Booleans, here: Here
) -> Booleans:
    """(w, h): where the agent drove since it left the largest connected part of the ground, and the
    places beside; none while it is there.

    It drove there, so that it can drive back, over a kerb too. It does not drive through what has
    come to stand there; where it was a moment ago nothing stands, whatever it saw.
    """
    labels, number = ndimage.label(is_ground, SQUARE)
    if not number:
        return np.zeros_like(is_ground)

    sizes = np.bincount(labels.ravel())[1:]
    is_largest = labels == sizes.argmax() + 1
    was_there = here.at(path[:, POSITION], is_largest)
    left = len(was_there) - int(was_there[::-1].argmax()) if was_there.any() else len(was_there)
    way = path[left:]

    here_m = np.array([[agent.x_m, agent.y_m]])
    if here.at(here_m, is_largest).any():
        return np.zeros_like(is_ground)

    lately_s = agent.stamp_ns * 1e-9 - CAME_S
    is_late = way[:, PathColumn.STAMP_S] >= lately_s
    whole = here.has(np.vstack([way[:, POSITION], here_m]))
    late = here.has(np.vstack([way[is_late, POSITION], here_m]))
    is_way = ndimage.binary_dilation(whole, SQUARE) & ~is_obstacle
    return np.asarray(is_way | late)


def _path(graph: Graph) -> Floats:
    """(n, k): the rows of the path, the oldest first."""
    segments = sorted(graph.of_kind(PathSegment), key=lambda segment: segment.number)
    rows = [np.zeros((0, len(PathColumn)))]
    for segment in segments:
        rows.append(np.asarray(segment.rows.numpy(), np.float64))

    return np.vstack(rows)


def _lately_m(path: Floats, agent: Self, ago_s: float) -> Floats:
    """(n, 2): where the agent was since so many seconds ago, and is."""
    since_s = agent.stamp_ns * 1e-9 - ago_s
    is_late = path[:, PathColumn.STAMP_S] >= since_s
    here_m = np.array([[agent.x_m, agent.y_m]])
    return np.vstack([path[is_late, POSITION], here_m])


def _since_start_m(path_m: Floats) -> Floats:
    """The places of a path from where it has left its start: from there the agent did not look
    round.
    """
    from_start_m = np.hypot(*(path_m - path_m[:1]).T)
    has_left = from_start_m > LEFT_START_M
    since_m: Floats = path_m[has_left.cumsum() > 0]
    return since_m


def _with_goals(extent: Extent, goals: Sequence[Goal], cell_m: float, beyond: int) -> Extent:
    """The smallest rectangle with `extent` and the goals that are positions at most so many cells
    outside.
    """
    lower = np.array(extent.lower)
    upper = np.array(extent.upper)
    positions_m = [(goal.x_m, goal.y_m) for goal in goals if not goal.object]
    cells = np.rint(np.array(positions_m).reshape(-1, 2) / cell_m).astype(np.int64)
    is_near = ((cells >= lower - beyond) & (cells < upper + beyond)).all(axis=1)

    first_i, first_j = np.vstack([lower, cells[is_near]]).min(axis=0).tolist()
    last_i, last_j = np.vstack([upper, cells[is_near] + 1]).max(axis=0).tolist()
    return Extent((first_i, first_j), (last_i, last_j))


def _with_margin(extent: Extent, cells: int) -> Extent:
    first_i, first_j = extent.lower
    last_i, last_j = extent.upper
    return Extent((first_i - cells, first_j - cells), (last_i + cells, last_j + cells))


def _ends(shape: tuple[int, int], offset: tuple[int, int]) -> tuple[Slices, Slices]:
    """The places of a (w, h) grid that have a neighbour at `offset`, and those neighbours."""
    here = []
    there = []
    for size, step in zip(shape, offset, strict=True):
        here.append(slice(max(0, -step), size - max(0, step)))
        there.append(slice(max(0, step), size - max(0, -step)))

    return (here[0], here[1]), (there[0], there[1])


def _has_cut(weights: Singles) -> Booleans:
    """(w, h): whether any link of a place to its neighbours is cut."""
    _, width, height = weights.shape
    has_cut = np.zeros((width, height), bool)
    for of_link, offset in zip(weights, LINK_OFFSETS.tolist(), strict=True):
        here, there = _ends((width, height), offset)
        is_cut = of_link[here] < CUT_BELOW
        has_cut[here] |= is_cut
        has_cut[there] |= is_cut

    return has_cut


def _opened(weights: Singles, is_open: Booleans) -> Singles:
    """(4, w, h): the weights, with links between open places open."""
    opened = weights.copy()
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = _ends(is_open.shape, offset)
        of_link = opened[number][here]
        of_link[is_open[here] & is_open[there]] = 1.0

    return opened


def _links(weights: Singles, share: Floats) -> Singles:
    """(4, w, h): the weights of links, by the lower share of the two places each joins."""
    _, width, height = weights.shape
    links = np.zeros_like(weights)
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = _ends((width, height), offset)
        lower = np.minimum(share[here], share[there])
        links[number][here] = lower * (weights[number][here] >= CUT_BELOW)

    return links
