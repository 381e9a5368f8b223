"""What it costs to drive over the places of a map: layers, each a factor with its reason.

A place is as dear as the product of its layers, so that there is one network to plan on (paper
§5.3: links that a boundary cuts are not crossed). Beyond the paper, road that was blocked may be
free again: it costs much, and the more, the less time has passed since it was looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Singles
from cogmap.graph.graph import Graph
from cogmap.graph.window import LINK_OFFSETS, Extent
from cogmap.robot import HALF_WIDTH_M
from cogmap.schemas.nodes import CostLayer, Goal, Self
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.corridor import Corridor
from cogmap.services.codelets.planning.ground import Ground
from cogmap.services.codelets.planning.network import (
    PlaceGrid,
    PlaceNetwork,
    place_network,
    with_beside,
)

BESIDE_COST = 2.0
"""Of a place beside a blocked one: it halves the weight, so that a route keeps off kerbs where the
street is wide enough. Chosen on simulated towns."""

BLOCKED_COST = 500.0
"""Of road that was blocked, long after it was looked at: to try a barrier one place wide costs as
much as a way round of 500 m. Chosen on simulated towns, where few barriers go."""

RETURN_COST = 1000.0
"""Of the way back as the agent came, whatever is on the map there by now: what is left if all else
is dearer."""

LATEST_LOOK_SHARE = 0.05
"""Of the time after which a street may be open again: looks that are more lately count alike."""

MARGIN_CELLS = 8
"""Unknown places around the map that are planned over: the width of a street."""

BEYOND_CELLS = 100
"""Places outside the map as far as which goals are planned: a block of houses."""


class PlaceCosts(NamedTuple):
    """The places of a rectangle of a map, and what it costs to drive over them.

    `layers`: (w, h) factors of at least 1, infinite where a place is blocked. `is_inside` (w, h):
    in the corridor that is planned on. `is_free` (w, h): nothing blocks the place. `is_known`
    (w, h): seen as road, or driven over. `is_clear` (w, h): nothing stands there or beside.
    `is_return` (w, h): where the agent came from. `is_visited` (w, h): seen from as near as can be.
    """

    grid: PlaceGrid
    layers: dict[CostLayer, Singles]
    is_inside: Booleans
    is_free: Booleans
    is_known: Booleans
    is_clear: Booleans
    is_return: Booleans
    is_visited: Booleans

    @property
    def is_known_free(self) -> Booleans:
        """Mark the places that are known and that nothing blocks, (w, h)."""
        return np.asarray(self.is_known & self.is_free)

    def cost(self, *without: CostLayer) -> Singles:
        """Multiply the layers, but for some, (w, h)."""
        product = _factor(~self.is_inside, np.inf)
        for layer, factor in self.layers.items():
            if layer not in without:
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
    extent = extent_with(goals, graph, agent.map) if within is None else within.extent
    ground = Ground.of(graph, agent, extent)
    is_known = ground.is_known()
    is_obstacle = ground.is_obstacle()
    is_driven = ground.is_driven_over(is_obstacle)
    is_edge = ground.is_cut() & ~is_driven & ~is_obstacle
    is_narrow = narrow(is_obstacle, ground.grid.cell_m) & ~is_driven & ~is_edge
    is_blocked = is_edge | is_obstacle | is_narrow
    is_beside = with_beside(is_blocked) & ~is_blocked

    # Blocked road is tried the later, the less time has passed since the agent looked at it; not
    # at all if it was so near that it would have seen it free.
    is_return = ground.is_return(is_obstacle)
    blocked_cost = np.where(is_known, np.float32(BLOCKED_COST), np.float32(np.inf))
    blocked_cost[is_return] = RETURN_COST
    after_s = config.reopens_after_s
    seen_cost = 1 / (ground.looked_ago_s(after_s) / after_s).clip(LATEST_LOOK_SHARE, 1.0)
    seen_cost[ground.is_seen_near(after_s)] = np.inf
    seen_cost[is_return] = 1.0

    layers = {
        CostLayer.UNKNOWN: _factor(~is_known, config.unknown_cost),
        CostLayer.EDGE: _factor(is_edge, blocked_cost),
        CostLayer.OBSTACLE: _factor(is_obstacle, blocked_cost),
        CostLayer.NARROW: _factor(is_narrow, blocked_cost),
        CostLayer.SEEN_LATELY: _factor(is_blocked, seen_cost),
        CostLayer.BESIDE: _factor(is_beside, BESIDE_COST),
    }
    return PlaceCosts(
        grid=ground.grid,
        layers=layers,
        is_inside=np.ones(ground.grid.shape, bool) if within is None else within.is_inside,
        is_free=~is_blocked,
        is_known=is_known,
        is_clear=~with_beside(is_obstacle),
        is_return=is_return,
        is_visited=ground.is_visited(),
    )


def _factor(mask: Booleans, factor: Singles | Floats | float) -> Singles:
    """Return a factor on the cost of the places of a mask, 1 elsewhere, (w, h)."""
    return np.where(mask, np.asarray(factor, np.float32), np.float32(1.0))


def extent_with(goals: Sequence[Goal], graph: Graph, map_id: str) -> Extent:
    """Return the rectangle of a map's places, with the goals that are positions at most
    BEYOND_CELLS outside, and a margin.
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


def narrow(is_obstacle: Booleans, cell_m: float) -> Booleans:
    """Mark the free places (w, h) between two obstacles, if the robot is wider than a place."""
    is_between = np.zeros_like(is_obstacle)
    if cell_m >= 2 * HALF_WIDTH_M:
        return is_between

    around = np.pad(is_obstacle, 1)
    width, height = is_obstacle.shape
    for di, dj in LINK_OFFSETS.tolist():
        one = around[1 + di : 1 + di + width, 1 + dj : 1 + dj + height]
        other = around[1 - di : 1 - di + width, 1 - dj : 1 - dj + height]
        is_between |= one & other

    is_between &= ~is_obstacle
    return is_between
