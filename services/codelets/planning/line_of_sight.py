"""Routes along lines of sight (beyond the paper): along links in eight directions a line through a
street is up to 8 % longer than straight.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices, Singles
from cogmap.services.codelets.planning.network import Cell

MAX_CELLS = 100
"""Of a line: by then it is longer than most streets."""

# So many ends of a line are tried at once: most routes bend within a few places.
_AT_ONCE = 12

# Half a cell, nearly: from there on another cell is nearer.
_INSIDE = 0.49


def straightened(route: Indices, cost: Singles, is_clear: Booleans, origin: Cell) -> Floats:
    """Replace the bends of a route of (n, 2) neighbouring cells by straight lines of at most
    MAX_CELLS, if these are no dearer by the cost of places, and lead over clear ones alone; (w, h)
    each, from the cell `origin`.

    The (m, 2) positions are in cells, each nearest to the cell that it leads over: between the
    middles of two cells a straight line has no steps, at which an agent would slow down.
    """
    inside = route - np.array(origin)
    if len(inside) == 1:
        return route.astype(np.float64)

    steps = np.hypot(*np.diff(inside, axis=0).T)
    dearer = np.maximum(cost[tuple(inside[:-1].T)], cost[tuple(inside[1:].T)])
    spent = np.concatenate([[0.0], np.cumsum(steps * dearer)])

    bends = [0]
    while bends[-1] < len(inside) - 1:
        bends.append(_farthest(inside, spent, cost, is_clear, bends[-1]))

    starts = inside[bends[:-1]]
    ends = inside[bends[1:]]
    cells, steps = straight(starts, ends)
    along = np.arange(cells.shape[1])
    slopes = (ends - starts) / steps[:, None]
    exact = starts[:, None] + along[:, None] * slopes[:, None]
    within = np.minimum(np.maximum(exact, cells - _INSIDE), cells + _INSIDE)

    is_step = (along >= 1) & (along <= steps[:, None])
    line: Floats = np.vstack([inside[:1], within[is_step]]) + np.array(origin)
    return line


def straight(starts: Indices, ends: Indices) -> tuple[Indices, Indices]:
    """Return (m, n, 2) neighbouring cells from (m, 2) or (1, 2) starts to (m, 2) ends, as nearly in
    a straight line as can be, each line's last repeated to the length of the longest; (m,) how many
    steps each has.
    """
    away = ends - starts
    steps = np.maximum(np.abs(away).max(axis=1), 1)
    along = np.minimum(np.arange(int(steps.max()) + 1), steps[:, None])
    # In whole numbers, so that the line is the same on every machine.
    half = steps[:, None, None]
    cells: Indices = starts[:, None] + (2 * along[..., None] * away[:, None] + half) // (2 * half)
    return cells, steps


def _farthest(route: Indices, spent: Floats, cost: Singles, is_clear: Booleans, at: int) -> int:
    """Return the number of the last cell of a route before one to which a line from number `at` is
    dearer than the route; that of the next cell in any case.
    """
    last = min(at + MAX_CELLS, len(route) - 1)
    first = at + 2
    while first <= last:
        chosen = np.arange(first, min(first + _AT_ONCE, last + 1))
        line_cost = _costs(route[at : at + 1], route[chosen], cost, is_clear)
        is_dearer = line_cost > spent[chosen] - spent[at] + 1e-9
        if is_dearer.any():
            return max(int(chosen[is_dearer.argmax()]) - 1, at + 1)
        first += _AT_ONCE

    return max(last, at + 1)


def _costs(start: Indices, ends: Indices, cost: Singles, is_clear: Booleans) -> Floats:
    """Return the (m,) costs of straight lines from (1, 2) to each of (m, 2), infinite for one that
    passes a place that is not clear, or between two of which one is blocked.
    """
    cells, steps = straight(start, ends)
    i = cells[..., 0]
    j = cells[..., 1]
    on = np.where(is_clear[i, j], cost[i, j], np.inf)
    dearer = np.maximum(on[:, 1:], on[:, :-1])
    is_corner = np.isinf(cost[i[:, 1:], j[:, :-1]]) | np.isinf(cost[i[:, :-1], j[:, 1:]])

    is_step = np.arange(1, cells.shape[1]) <= steps[:, None]
    length = np.hypot(*(ends - start).T) / steps
    total = np.where(is_step, dearer, 0.0).sum(axis=1) * length
    total[(is_corner & is_step).any(axis=1)] = np.inf
    return np.asarray(total)
