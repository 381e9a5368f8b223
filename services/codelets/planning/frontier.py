"""Exploration: which edge of the known ground promises most (beyond the paper)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.planning.activation import spread
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.ground import Ground
from cogmap.services.codelets.planning.network import SQUARE


class Standpoint(NamedTuple):
    """The cell that the agent is at, and where it heads."""

    cell: tuple[int, int]
    heading_rad: float


class Frontier(NamedTuple):
    """An edge of the known ground: the cell (i, j) to drive to, and what it promises."""

    cell: tuple[int, int]
    promise: float


def best_frontier(
    ground: Ground, agent: Standpoint, config: Config, near: tuple[int, int] | None = None
) -> Frontier | None:
    """The frontier that promises most from where the agent is; None where all is known.

    A frontier promises the unknown places around it, over the effort to get there: its distance,
    and the turn that it takes. Where the agent is, there is none. The one beside `near`, where it
    goes already, is kept until another promises clearly more.
    """
    distance_m = spread(ground.known, np.array([agent.cell])).distance_m
    is_unknown = ground.is_free & ~ground.is_known
    is_reached = ground.is_known & np.isfinite(distance_m)
    is_open = ndimage.binary_dilation(is_unknown, SQUARE) & ~ground.is_visited
    is_elsewhere = distance_m > config.reached_m
    is_edge = is_open & is_reached & is_elsewhere

    effort_m = distance_m + config.frontier_offset_m + _turning_m(ground, agent, config)
    promise = _unknown_around(is_unknown, ground, config) / effort_m
    frontiers = []
    for cells in _edges(is_edge):
        i, j = _middle(cells)
        i0, j0 = ground.network.origin
        frontiers.append(Frontier((i0 + i, j0 + j), float(promise[i, j]) * len(cells)))

    return _chosen(frontiers, near, config)


def _turning_m(ground: Ground, agent: Standpoint, config: Config) -> Floats:
    """(w, h): the effort of turning towards each place, `turn_m` for one behind the agent."""
    width, height = ground.is_free.shape
    i, j = ground.network.index_of(agent.cell)
    ahead = (np.arange(width) - i)[:, None] * math.cos(agent.heading_rad)
    aside = (np.arange(height) - j) * math.sin(agent.heading_rad)
    away = np.hypot((np.arange(width) - i)[:, None], np.arange(height) - j)

    cos = (ahead + aside) / np.maximum(away, 1.0)
    turning_m: Floats = config.turn_m * (1 - cos) / 2
    return turning_m


def _unknown_around(is_unknown: Booleans, ground: Ground, config: Config) -> Floats:
    """(w, h): the unknown share of the square within sight of each place."""
    cells = 2 * round(config.sight_m / ground.network.cell_m) + 1
    unknown = is_unknown.astype(np.float64)

    around: Floats = ndimage.uniform_filter(unknown, cells, mode="constant", cval=1.0)
    return around


def _edges(is_edge: Booleans) -> Iterator[Indices]:
    """The connected edges, (k, 2) indices each."""
    labels, _ = ndimage.label(is_edge, SQUARE)
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        corner = np.array([side.start for side in box])
        yield corner + np.argwhere(labels[box] == number)


def _middle(cells: Indices) -> tuple[int, int]:
    """The cell of (k, 2) that is nearest to their mean."""
    away = cells - cells.mean(axis=0)
    nearest = int(np.hypot(*away.T).argmin())
    i, j = cells[nearest].tolist()
    return i, j


def _chosen(
    frontiers: list[Frontier], near: tuple[int, int] | None, config: Config
) -> Frontier | None:
    best = max(frontiers, key=lambda frontier: frontier.promise, default=None)
    if best is None or near is None:
        return best

    def away(frontier: Frontier) -> float:
        i, j = frontier.cell
        return float(np.hypot(i - near[0], j - near[1]))

    kept = min(frontiers, key=away)
    is_same = away(kept) <= config.same_frontier_cells
    if is_same and kept.promise >= config.keep_share * best.promise:
        return kept
    return best
