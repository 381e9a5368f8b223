"""The ground that the agent may drive over: place nodes and links of a map, as planners need them.

Links that a boundary cuts are not crossed (paper §5.3). Beyond the paper, place nodes beside a cut
link or an obstacle are avoided by the robot's width, and those that were never seen as road cost
more.
"""

from __future__ import annotations

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
)
from cogmap.schemas.nodes import Goal, PlaceColumn, Self
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.corridor import Corridor
from cogmap.services.codelets.planning.driven import (
    POSITION,
    ahead_m,
    driven_lately_m,
    driven_since_start_m,
    is_road_ahead,
    way_back,
)
from cogmap.services.codelets.planning.looks import looked_ago_s
from cogmap.services.codelets.planning.network import SQUARE, Here, PlaceNetwork, ends, link_weights

COLUMNS = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE, *WEIGHT_COLUMNS)
SPREAD_FROM = 0.2
BESIDE_CUT = 0.5
LEAST_DOUBT = 0.05
# So far to each side of its path the agent has driven over the ground.
BESIDE_PATH_M = 1.0


class Ground(NamedTuple):
    """The place nodes of one map within a rectangle.

    `is_free` (w, h): the robot fits there. `is_known` (w, h): seen as road, or driven over, and
    free; `is_clear` (w, h): that, and nothing stands beside it. `is_visited` (w, h): beside the
    path, seen from as near as can be. `network` has links between free places, lighter where
    unknown; `known` has those between known places only. `doubted` has those of `network`, and the
    lightest where road is blocked that was not seen from near lately: it may be free again, the
    less likely the more lately it was looked at from farther away. All three have the lightest
    links along the way back, where the agent has left all other ground.
    """

    is_free: Booleans
    is_known: Booleans
    is_clear: Booleans
    is_visited: Booleans
    network: PlaceNetwork
    known: PlaceNetwork
    doubted: PlaceNetwork


def ground(
    graph: Graph,
    agent: Self,
    config: Config,
    goals: Sequence[Goal] = (),
    within: Corridor | None = None,
) -> Ground:
    """The ground of the agent's map and some unknown places around it, as far as to those of
    `goals` that are positions not too far outside; that `within` a corridor alone, where one is
    given.

    The path that the agent took counts as known, and as free where nothing stands there by now: an
    edge that is mapped across it is a mistake. Ground ahead that is too near for its camera counts
    as known where road begins behind it.
    """
    map_id = agent.map
    extent = _extent(graph, map_id, goals, config) if within is None else within.extent
    window = graph.places.window(map_id, COLUMNS, extent)
    weights = window.weights()

    here = Here(window.origin, window.shape, graph.cell_m(map_id))
    path = rows_of(graph.path)
    path_m = path[:, POSITION]
    is_seen = window.column(PlaceColumn.ROAD) >= ROAD_FROM
    driven_m = path_m
    if is_road_ahead(agent, path_m, is_seen, here, config):
        driven_m = np.vstack([path_m, ahead_m(agent, 0.0, config.blind_m)])
    is_known = is_seen | here.is_within(config.driven_m, driven_m)

    is_obstacle = stands_there(window.column(PlaceColumn.OBSTACLE))
    is_driven = here.is_within(BESIDE_PATH_M, path_m) & ~_without_gaps(is_obstacle)
    is_edge = (_has_cut(weights) & ~is_driven) | is_obstacle
    is_way_back = way_back(path, agent, is_known & ~is_edge, is_obstacle, here)
    weights = _opened(weights, is_way_back | is_driven)

    is_beside = ndimage.binary_dilation(is_obstacle, SQUARE)
    share = _shares(is_edge)
    share[is_way_back & is_edge] = config.doubt_weight
    if within is not None:
        share[~within.is_inside] = 0.0
    optimistic = np.where(is_known, share, share * config.unknown_weight)

    lately_m = driven_lately_m(path, agent, config.doubt_after_s)
    is_seen_lately = here.is_within(config.doubt_from_m, lately_m)
    is_in_doubt = is_known & is_edge & ~is_seen_lately
    ago_s = looked_ago_s(path, agent, config.doubt_after_s, here)
    doubt = (ago_s / config.doubt_after_s).clip(LEAST_DOUBT, 1.0)
    in_doubt = np.where(is_in_doubt, config.doubt_weight * doubt, optimistic)

    return Ground(
        is_free=~is_edge,
        is_known=is_known & ~is_edge,
        is_clear=is_known & ~is_edge & ~is_beside & (share > 0),
        is_visited=here.is_within(config.visited_m, driven_since_start_m(path_m)),
        network=here.network(link_weights(weights, optimistic)),
        known=here.network(link_weights(weights, np.where(is_known, share, 0.0))),
        doubted=here.network(link_weights(_opened(weights, is_known), in_doubt)),
    )


def stands_there(obstacle: Singles) -> Booleans:
    """(w, h): where something stands. From far it is seen now in a cell, now in the one behind it:
    all of what was seen there and beside counts, where it would do for a row of three.
    """
    around = ndimage.uniform_filter(obstacle, 3, mode="constant") * SQUARE.size
    is_spread = (obstacle >= SPREAD_FROM) & (around >= 3 * OBSTACLE_FROM)
    return np.asarray((obstacle >= OBSTACLE_FROM) | is_spread)


def _without_gaps(is_obstacle: Booleans) -> Booleans:
    """(w, h): the obstacles, and the gaps between them that are no wider than a place."""
    return np.asarray(ndimage.binary_closing(is_obstacle, SQUARE) | is_obstacle)


def _shares(is_edge: Booleans) -> Floats:
    """(w, h): how well each place can be driven over: not at an edge, less beside one."""
    is_beside = ndimage.binary_dilation(is_edge, SQUARE)
    share = np.where(is_beside, BESIDE_CUT, 1.0)
    share[is_edge] = 0.0
    return share


def _extent(graph: Graph, map_id: str, goals: Sequence[Goal], config: Config) -> Extent:
    """The rectangle of place nodes that is planned on."""
    extent = graph.places.extent(map_id)
    extent = _with_goals(extent, goals, graph.cell_m(map_id), config.beyond_cells)
    return extent.grown(config.margin_cells)


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


def _has_cut(weights: Singles) -> Booleans:
    """(w, h): whether any link of a place to its neighbours is cut."""
    _, width, height = weights.shape
    has_cut = np.zeros((width, height), bool)
    for of_link, offset in zip(weights, LINK_OFFSETS.tolist(), strict=True):
        here, there = ends((width, height), offset)
        is_cut = of_link[here] < CUT_BELOW
        has_cut[here] |= is_cut
        has_cut[there] |= is_cut

    return has_cut


def _opened(weights: Singles, is_open: Booleans) -> Singles:
    """(4, w, h): the weights, with links between open places open."""
    opened = weights.copy()
    for number, offset in enumerate(LINK_OFFSETS.tolist()):
        here, there = ends(is_open.shape, offset)
        of_link = opened[number][here]
        of_link[is_open[here] & is_open[there]] = 1.0

    return opened
