"""Exploration: which edge of the known ground promises most (beyond the paper)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats, Indices
from services.codelets.planning.activation import spread
from services.codelets.planning.config import Config
from services.codelets.planning.ground import SQUARE, Ground


class Frontier(NamedTuple):
    """An edge of the known ground: the cell (i, j) to drive to, and what it promises."""

    cell: tuple[int, int]
    promise: float


def best_frontier(
    ground: Ground, agent: tuple[int, int], config: Config, near: tuple[int, int] | None = None
) -> Frontier | None:
    """The frontier that promises most from the agent's cell; None where all is known.

    A frontier promises the unknown places around it, over its distance. The one beside `near`,
    where the agent goes already, is kept until another promises clearly more.
    """
    distance_m = spread(ground.known, np.array([agent])).distance_m
    is_unknown = ground.is_free & ~ground.is_known
    is_reached = ground.is_known & np.isfinite(distance_m)
    is_edge = ndimage.binary_dilation(is_unknown, SQUARE) & is_reached

    cost_m = distance_m + config.frontier_offset_m
    promise = _unknown_around(is_unknown, ground, config) / cost_m
    frontiers = []
    for cells in _edges(is_edge, config):
        i, j = _middle(cells)
        i0, j0 = ground.network.origin
        frontiers.append(Frontier((i0 + i, j0 + j), float(promise[i, j]) * len(cells)))

    return _chosen(frontiers, near, config)


def _unknown_around(is_unknown: Booleans, ground: Ground, config: Config) -> Floats:
    """(w, h): the unknown share of the square within sight of each place."""
    cells = 2 * round(config.sight_m / ground.network.cell_m) + 1
    unknown = is_unknown.astype(np.float64)

    around: Floats = ndimage.uniform_filter(unknown, cells, mode="constant", cval=1.0)
    return around


def _edges(is_edge: Booleans, config: Config) -> Iterator[Indices]:
    """The connected edges that are wide enough to pass, (k, 2) indices each."""
    labels, _ = ndimage.label(is_edge, SQUARE)
    for number, box in enumerate(ndimage.find_objects(labels), start=1):
        corner = np.array([side.start for side in box])
        cells = corner + np.argwhere(labels[box] == number)
        if len(cells) >= config.frontier_cells:
            yield cells


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
