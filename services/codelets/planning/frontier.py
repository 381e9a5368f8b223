"""Exploration: which edge of the known ground promises most (beyond the paper)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.services.codelets.planning.activation import Field
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.network import EIGHT, Cell, with_beside
from cogmap.services.codelets.planning.place_cost import PlaceCosts

# The constants of this module were chosen on simulated towns, by how much of them was explored.

SIGHT_M = 12.0
"""Distance at which road is seen."""

TURN_M = 15.0
"""Distance that is as much effort as turning round towards a frontier."""

OFFSET_M = 10.0
"""Added to the distance of each frontier, so that a near one of little promise does not win."""

SAME_FRONTIER_CELLS = 6
"""A frontier moves by so many cells from plan to plan."""

KEEP_SHARE = 0.6
"""The frontier that the agent goes to is kept while it promises this share of the best."""


class Standpoint(NamedTuple):
    """The cell that the agent is at, and where it heads."""

    cell: Cell
    heading_rad: float


class Frontier(NamedTuple):
    """An edge of the known ground: the cell (i, j) to drive to, and what it promises."""

    cell: Cell
    promise: float


def best_frontier(
    costs: PlaceCosts, field: Field, agent: Standpoint, config: Config, near: Cell | None = None
) -> Frontier | None:
    """Return the frontier that promises most; None if all is known.

    `field` spreads from the agent over known places. A frontier promises the unknown places around
    it, over the effort to get there: its distance, and the turn that it takes. Where the agent is,
    there is none. The one beside `near`, where it goes already, is kept until another promises
    clearly more.
    """
    is_unknown = costs.is_free & ~costs.is_known
    is_open = with_beside(is_unknown) & ~costs.is_visited
    is_reached = np.isfinite(field.distance_m) & (field.distance_m > config.reached_m)
    is_edge = is_open & costs.is_known_free & is_reached

    # Turning towards a place behind the agent takes as much effort as driving TURN_M.
    width, height = is_edge.shape
    i, j = field.network.index_of(agent.cell)
    away_i = (np.arange(width) - i)[:, None]
    away_j = np.arange(height) - j
    ahead = away_i * math.cos(agent.heading_rad) + away_j * math.sin(agent.heading_rad)
    cos = ahead / np.hypot(away_i, away_j).clip(1.0)
    effort_m = field.distance_m + OFFSET_M + TURN_M * (1 - cos) / 2

    side = 2 * round(SIGHT_M / costs.grid.cell_m) + 1
    around = ndimage.uniform_filter(is_unknown.astype(np.float64), side, mode="constant", cval=1.0)
    promise = around / effort_m

    # Of each connected edge, the agent goes to the cell nearest to its middle.
    frontiers = []
    labels, _ = ndimage.label(is_edge, EIGHT)
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        corner = np.array([side.start for side in box])
        cells = corner + np.argwhere(labels[box] == number)
        middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
        i, j = (middle + costs.grid.origin).tolist()
        frontiers.append(Frontier((i, j), float(promise[tuple(middle)]) * len(cells)))

    best = max(frontiers, key=lambda frontier: frontier.promise, default=None)
    if best is None or near is None:
        return best

    cells = np.array([frontier.cell for frontier in frontiers])
    away = np.hypot(*(cells - near).T)
    kept = frontiers[int(away.argmin())]
    if away.min() <= SAME_FRONTIER_CELLS and kept.promise >= KEEP_SHARE * best.promise:
        return kept
    return best
