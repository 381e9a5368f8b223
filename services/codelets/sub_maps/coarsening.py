"""Place nodes of a coarser grid, from those of a finer one. Pure.

A coarse cell is FACTOR cells wide; its node stands where that of its middle cell does.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from cogmap.geometry.arrays import Booleans, Singles
from cogmap.graph.window import CUT_BELOW, LINK_OFFSETS, OBSTACLE_FROM

# That of the planner by the paper's first author (§5.5).
FACTOR = 3
MARGIN = FACTOR
"""Of the finer cells, so many more are needed on each side."""

Values = TypeVar("Values", Singles, Booleans)


class Places(NamedTuple):
    """Place nodes of a rectangle of cells: how far each is road, 0 to 1, (w, h), and which of its
    own links, in the order of LINK_OFFSETS, can be traversed, (4, w, h).
    """

    road: Singles
    is_open: Booleans


def places_of(road: Singles, obstacle: Singles, weights: Singles) -> Places:
    """Find the place nodes of a map, by columns (w, h) and the (4, w, h) weights of links.

    No link leads to where something stands. Links that leave the rectangle are judged by their own
    weight.
    """
    _, width, height = weights.shape
    stands = np.pad(obstacle >= OBSTACLE_FROM, 1)
    is_free = ~stands[1:-1, 1:-1]

    is_open = weights >= CUT_BELOW
    for number, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        beyond = stands[1 + di : 1 + di + width, 1 + dj : 1 + dj + height]
        is_open[number] &= is_free & ~beyond

    return Places(road, is_open)


def coarser(fine: Places) -> Places:
    """Compute the coarse place nodes of a rectangle that `fine` covers with a margin of MARGIN on
    each side.

    A coarse node is as much road as the most road-like place in it. A link can be traversed if some
    row of the finer links leads from beside the one node to beside the other; diagonally, if the
    row between them does.
    """
    road = np.max([_block(fine.road, i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)

    is_open = np.zeros((len(LINK_OFFSETS), *road.shape), bool)
    for number, (di, dj) in enumerate(LINK_OFFSETS.tolist()):
        of_link = fine.is_open[number]
        for aside in (0,) if di and dj else (-1, 0, 1):
            first_i, first_j = dj * aside, di * aside
            row = [_block(of_link, first_i + k * di, first_j + k * dj) for k in range(FACTOR)]
            is_open[number] |= np.all(row, axis=0)

    return Places(np.asarray(road, np.float32), is_open)


def _block(values: Values, i: int, j: int) -> Values:
    """Return for each coarse cell the value of the finer cell at (i, j) from its middle, (w, h)."""
    first = MARGIN + FACTOR // 2
    width, height = ((size - 2 * MARGIN) // FACTOR for size in values.shape)
    rows = slice(first + i, first + i + FACTOR * width, FACTOR)
    columns = slice(first + j, first + j + FACTOR * height, FACTOR)
    return values[rows, columns]
