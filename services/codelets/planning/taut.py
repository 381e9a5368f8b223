"""Routes drawn taut (beyond the paper): along links in eight directions a line through a street is
up to 8 % longer than straight.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.services.codelets.planning.network import Cell

LONGEST_CELLS = 100
# Half a cell, nearly: from there on another cell is nearer.
INSIDE = 0.49


def taut(route: Indices, origin: Cell, is_clear: Booleans) -> Floats:
    """A route of (n, 2) neighbouring cells, with straight lines of at most LONGEST_CELLS in the
    place of its bends where these lead over clear cells, (w, h) from the cell `origin`.

    Its (m, 2) positions are in cells, each nearest to the cell that it leads over: between the
    middles of two cells a straight line has no steps, at which an agent would slow down.
    """
    inside = route - np.array(origin)
    positions = [inside[:1].astype(np.float64)]
    at = 0
    while at < len(inside) - 1:
        end = _farthest(inside, at, is_clear)
        positions.append(_along(inside[at], inside[end])[1:])
        at = end

    line: Floats = np.concatenate(positions) + np.array(origin)
    return line


def straight(start: Indices, end: Indices) -> Indices:
    """(n, 2): neighbouring cells from one to another, as nearly in a straight line as can be."""
    away = end - start
    steps = _steps(away)
    along = np.arange(steps + 1)[:, None]
    # In whole numbers, so that the line is the same on every machine.
    cells: Indices = start + (2 * along * away + steps) // (2 * steps)
    return cells


def _along(start: Indices, end: Indices) -> Floats:
    """(n, 2): the positions of a straight line that are nearest to its cells."""
    away = end - start
    steps = _steps(away)
    exact = start + np.arange(steps + 1)[:, None] * away / steps

    cells = straight(start, end)
    positions: Floats = exact.clip(cells - INSIDE, cells + INSIDE)
    return positions


def _steps(away: Indices) -> int:
    return max(1, int(np.abs(away).max()))


def _farthest(route: Indices, at: int, is_clear: Booleans) -> int:
    """The number of the last cell of a route before one to which no line leads from number `at`
    over clear cells; that of the next cell in any case.
    """
    last = min(at + LONGEST_CELLS, len(route) - 1)
    for number in range(at + 2, last + 1):
        if not _leads_over(straight(route[at], route[number]), is_clear):
            return number - 1

    return max(last, at + 1)


def _leads_over(line: Indices, is_clear: Booleans) -> bool:
    """Whether a line of (n, 2) cells leads over clear ones alone, and past no corner."""
    i, j = line.T
    is_on = is_clear[i, j].all()
    is_beside = is_clear[i[1:], j[:-1]] & is_clear[i[:-1], j[1:]]
    return bool(is_on and is_beside.all())
