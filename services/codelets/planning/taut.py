"""Routes drawn taut (beyond the paper): along links in eight directions a line through a street is
up to 8 % longer than straight.
"""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Booleans, Indices
from services.codelets.planning.network import Cell

LONGEST_CELLS = 100


def taut(route: Indices, origin: Cell, is_clear: Booleans) -> Indices:
    """A route of (n, 2) neighbouring cells, with straight lines of at most LONGEST_CELLS in the
    place of its bends where these lead over clear cells, (w, h) from the cell `origin`.
    """
    inside = route - np.array(origin)
    lines = [inside[:1]]
    at = 0
    while at < len(inside) - 1:
        line, at = _farthest(inside, at, is_clear)
        lines.append(line[1:])

    cells: Indices = np.concatenate(lines) + np.array(origin)
    return cells


def straight(start: Indices, end: Indices) -> Indices:
    """(n, 2): neighbouring cells from one to another, as nearly in a straight line as can be."""
    away = end - start
    steps = max(1, int(np.abs(away).max()))
    along = np.arange(steps + 1)[:, None]
    # In whole numbers, so that the line is the same on every machine.
    cells: Indices = start + (2 * along * away + steps) // (2 * steps)
    return cells


def _farthest(route: Indices, at: int, is_clear: Booleans) -> tuple[Indices, int]:
    """The line from number `at` of a route to the last cell before one to which no line leads over
    clear cells, and the number of that cell; to the next cell in any case.
    """
    line = route[at : at + 2]
    last = min(at + LONGEST_CELLS, len(route) - 1)
    for number in range(at + 2, last + 1):
        longer = straight(route[at], route[number])
        if not _leads_over(longer, is_clear):
            return line, number - 1
        line = longer

    return line, max(last, at + 1)


def _leads_over(line: Indices, is_clear: Booleans) -> bool:
    """Whether a line of (n, 2) cells leads over clear ones alone, and past no corner."""
    i, j = line.T
    is_on = is_clear[i, j].all()
    is_beside = is_clear[i[1:], j[:-1]] & is_clear[i[:-1], j[1:]]
    return bool(is_on and is_beside.all())
