"""Figure 5 A and B: activation that spreads from a goal over place nodes, and the route that
follows it, over free ground and round walls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cogmap.errors import CogmapError
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.planning.activation import spread
from cogmap.services.codelets.planning.network import grid_network

SIDE = 27
START = (3, 6)
GOAL = (22, 19)
# Two walls, as the cells (i, j) from the first to the last.
WALLS = (((9, 0), (9, 17)), ((17, 9), (17, 26)))


class Spread(NamedTuple):
    """Which cells (w, h) are free, the logarithm of the activation there, and the cells (n, 2) of
    the route to the goal.
    """

    is_free: Booleans
    log_activation: Floats
    route: Indices


def free_ground() -> Spread:
    """Spread activation with nothing between start and goal."""
    return _spread(np.ones((SIDE, SIDE), bool))


def walled_ground() -> Spread:
    """Spread activation round WALLS: the links across them have the weight 0."""
    is_free = np.ones((SIDE, SIDE), bool)
    for (first_i, first_j), (last_i, last_j) in WALLS:
        is_free[first_i : last_i + 1, first_j : last_j + 1] = False

    return _spread(is_free)


def _spread(is_free: Booleans) -> Spread:
    network = grid_network(is_free)
    field = spread(network, np.array([GOAL]))
    route = field.climb(START)
    if route is None:
        raise CogmapError("no route leads from the start to the goal of figure 5")

    return Spread(is_free, field.log_activation, route)
