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
BESIDE_CUT = 0.5
BLIND_STEP_M = 0.5
LEFT_START_M = 3.0
# Where the agent drove so lately it can drive back.
CAME_S = 60.0
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

    The path that the agent took counts as known, and so does the ground ahead that is too near for
    its camera.
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
    driven_m = np.vstack([path_m, _blind_m(agent, config)])
    is_seen = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    is_known = is_seen | here.is_within(config.driven_m, driven_m)

    is_obstacle = window.column(PlaceColumn.OBSTACLE) >= OBSTACLE_FROM
    is_edge = _has_cut(weights) | is_obstacle
    share = _shares(is_edge)
    optimistic = np.where(is_known, share, share * config.unknown_weight)

    lately_m = _lately_m(path, agent, config.doubt_after_s)
    just_now_m = _lately_m(path, agent, CAME_S)
    is_seen_lately = here.is_within(config.doubt_from_m, lately_m)
    is_seen_lately[here.around(just_now_m)] = False
    is_in_doubt = is_known & is_edge & ~is_seen_lately
    in_doubt = np.where(is_in_doubt, config.doubt_weight, optimistic)
    reopened = _reopened(weights, is_known)

    return Ground(
        is_free=~is_edge,
        is_known=is_known & ~is_edge,
        is_visited=here.is_within(config.visited_m, _since_start_m(path_m)),
        network=here.network(_links(weights, optimistic)),
        known=here.network(_links(weights, np.where(is_known, share, 0.0))),
        doubted=here.network(_links(reopened, in_doubt)),
    )


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

    def around(self, positions_m: Floats) -> tuple[Indices, Indices]:
        """The cells of (n, 2) positions and those beside them, as far as they are inside."""
        steps = np.argwhere(SQUARE) - 1
        here = np.rint(positions_m / self.cell_m).astype(np.int64) - np.array(self.origin)
        cells = np.unique((here[:, None] + steps).reshape(-1, 2), axis=0)
        is_inside = ((cells >= 0) & (cells < self.shape)).all(axis=1)
        i, j = cells[is_inside].T
        return i, j

    def is_within(self, within_m: float, positions_m: Floats) -> Booleans:
        """(w, h): the cells within a distance of any of (n, 2) positions."""
        cells = np.rint(positions_m / self.cell_m).astype(np.int64) - np.array(self.origin)
        is_inside = ((cells >= 0) & (cells < self.shape)).all(axis=1)
        if not is_inside.any():
            return np.zeros(self.shape, bool)

        is_away = np.ones(self.shape, bool)
        is_away[tuple(cells[is_inside].T)] = False
        distance_m = ndimage.distance_transform_edt(is_away) * self.cell_m
        return np.asarray(distance_m <= within_m)


def _blind_m(agent: Self, config: Config) -> Floats:
    """(n, 2): positions ahead of the agent that its camera does not see."""
    ahead_m = np.arange(0.0, config.blind_m, BLIND_STEP_M)
    direction = np.array([math.cos(agent.heading_rad), math.sin(agent.heading_rad)])
    positions_m: Floats = np.array([agent.x_m, agent.y_m]) + ahead_m[:, None] * direction
    return positions_m


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


def _reopened(weights: Singles, is_known: Booleans) -> Singles:
    """(4, w, h): the weights, with links between known places open."""
    reopened = weights.copy()
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = _ends(is_known.shape, offset)
        of_link = reopened[number][here]
        of_link[is_known[here] & is_known[there]] = 1.0

    return reopened


def _links(weights: Singles, share: Floats) -> Singles:
    """(4, w, h): the weights of links, by the lower share of the two places each joins."""
    _, width, height = weights.shape
    links = np.zeros_like(weights)
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = _ends((width, height), offset)
        lower = np.minimum(share[here], share[there])
        links[number][here] = lower * (weights[number][here] >= CUT_BELOW)

    return links
