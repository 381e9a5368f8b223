"""The streets of a town of several blocks: an uneven grid with some stretches missing, dead ends
and a square. Pure.

A road is a stretch between two neighbouring crossings, so that closing one leaves every other
reachable.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from cogmap.services.sim.layout.plan import Point, Road

Crossing = tuple[int, int]
Stretch = tuple[Crossing, Crossing]

# Made up: the margin around the grid, and about how far its streets are apart.
EDGE_M = 20.0
BLOCK_M = 48.0
UNEVEN = (0.86, 1.18)
WIDTHS_M = {"Avenue": 11.0, "Street": 8.0, "Lane": 6.0}
# Made up: the width of dead ends, and the share of stretches that are left out at most.
ALLEY_M = 5.0
MISSING_SHARE = 0.22
DEAD_END_SHARE = (0.4, 0.6)
OUTWARD_M = (14.0, 18.0)
SQUARE_M = (26.0, 32.0)
SQUARE_NAME = "Market Square"
_NAMES = (
    "Oak",
    "Elm",
    "Ash",
    "Birch",
    "Cedar",
    "Maple",
    "Willow",
    "Linden",
    "Poplar",
    "Hazel",
    "Alder",
    "Rowan",
    "Cherry",
    "Pine",
    "Larch",
    "Beech",
    "Chestnut",
    "Walnut",
    "Plum",
    "Pear",
    "Apple",
    "Juniper",
    "Cypress",
    "Laurel",
    "Olive",
    "Hawthorn",
    "Sorrel",
    "Thistle",
    "Heather",
    "Clover",
)


@dataclass(frozen=True)
class Grid:
    """The lines of a grid of streets: where those along y and along x lie, and their widths."""

    x_m: tuple[float, ...]
    y_m: tuple[float, ...]
    width_x_m: tuple[float, ...]
    width_y_m: tuple[float, ...]

    @property
    def crossings(self) -> list[Crossing]:
        """Return all crossings, column by column."""
        columns = range(len(self.x_m))
        rows = range(len(self.y_m))
        return [(column, row) for column in columns for row in rows]

    def at(self, crossing: Crossing) -> Point:
        """Return where a crossing is."""
        column, row = crossing
        return self.x_m[column], self.y_m[row]

    def stretches(self) -> list[Stretch]:
        """Return all stretches between neighbouring crossings."""
        found: list[Stretch] = []
        for column, row in self.crossings:
            if column + 1 < len(self.x_m):
                found.append(((column, row), (column + 1, row)))
            if row + 1 < len(self.y_m):
                found.append(((column, row), (column, row + 1)))

        return found

    def line(self, stretch: Stretch) -> int:
        """Return the number of the line that a stretch is part of: those along y come first."""
        (column, row), (other_column, _) = stretch
        is_along_y = column == other_column
        return column if is_along_y else len(self.x_m) + row

    def width_m(self, stretch: Stretch) -> float:
        """Return the width of a stretch."""
        widths_m = (*self.width_x_m, *self.width_y_m)
        return widths_m[self.line(stretch)]


@dataclass(frozen=True)
class Streets:
    """The grid, its roads, the dead ends among them, and the square, which is the last road."""

    grid: Grid
    roads: tuple[Road, ...]
    dead_ends: tuple[Road, ...]
    square: Road


def plan(rng: np.random.Generator, size_m: float) -> Streets:
    """Plan the streets of a town of `size_m` to the side."""
    grid = _grid(rng, size_m)
    names = _Names(rng, grid)

    missing = _missing(rng, grid.stretches())
    kept = [stretch for stretch in grid.stretches() if stretch not in missing]

    through = []
    for stretch in kept:
        start, end = (grid.at(crossing) for crossing in stretch)
        through.append(Road(names.of(stretch), start, end, grid.width_m(stretch)))
    dead_ends = _dead_ends(rng, grid, missing, names)
    square = _square(rng, grid)

    roads = (*through, *dead_ends, square)
    return Streets(grid, roads, tuple(dead_ends), square)


def _grid(rng: np.random.Generator, size_m: float) -> Grid:
    x_m = _lines_m(rng, size_m)
    y_m = _lines_m(rng, size_m)

    columns = len(x_m)
    widths_m = _widths_m(rng, columns + len(y_m))
    return Grid(x_m, y_m, widths_m[:columns], widths_m[columns:])


def _lines_m(rng: np.random.Generator, size_m: float) -> tuple[float, ...]:
    """Draw where the lines of one direction lie, about BLOCK_M apart."""
    span_m = size_m - 2 * EDGE_M
    blocks = max(2, round(span_m / BLOCK_M))

    gaps = rng.uniform(*UNEVEN, blocks)
    lines = np.concatenate([[0.0], np.cumsum(gaps)])
    lines_m = span_m * (lines / lines[-1] - 0.5)

    return tuple(lines_m.round(1).tolist())


def _widths_m(rng: np.random.Generator, count: int) -> tuple[float, ...]:
    """Draw a width for each line: at least one of each kind."""
    kinds = list(WIDTHS_M.values())
    others = rng.choice(kinds, count - len(kinds), p=(0.25, 0.45, 0.3))
    widths_m = [*kinds, *others.tolist()]

    return tuple(rng.permutation(widths_m).tolist())


class _Names:
    """Names a line of the grid, and numbers the stretches of it."""

    def __init__(self, rng: np.random.Generator, grid: Grid) -> None:
        self._grid = grid
        self._words = [str(word) for word in rng.permutation(_NAMES)]
        self._used: dict[str, int] = {}

    def of(self, stretch: Stretch) -> str:
        """Return the name of a stretch, such as "Elm Street 2"."""
        width_m = self._grid.width_m(stretch)
        kind = min(WIDTHS_M, key=lambda kind: abs(WIDTHS_M[kind] - width_m))
        return self._numbered(self._grid.line(stretch), kind)

    def dead_end(self, number: int) -> str:
        """Return the name of a dead end, such as "Rowan Alley 1"."""
        lines = len(self._grid.x_m) + len(self._grid.y_m)
        return self._numbered(lines + number, "Alley")

    def _numbered(self, number: int, kind: str) -> str:
        more, place = divmod(number, len(self._words))
        line = f"{self._words[place]} {kind}"
        if more:
            line = f"New {line}" if more == 1 else f"New {line} {more}"

        count = self._used.get(line, 0) + 1
        self._used[line] = count
        return f"{line} {count}"


def _missing(rng: np.random.Generator, stretches: list[Stretch]) -> list[Stretch]:
    """Choose the stretches that are not built. If any one of the others is closed, all crossings
    stay reachable.
    """
    most = round(MISSING_SHARE * len(stretches))
    kept = list(stretches)

    missing: list[Stretch] = []
    for number in rng.permutation(len(stretches)).tolist():
        if len(missing) == most:
            break

        stretch = stretches[number]
        others = [other for other in kept if other != stretch]
        if _is_spare(stretch, others):
            kept = others
            missing.append(stretch)

    return missing


def _is_spare(stretch: Stretch, others: list[Stretch]) -> bool:
    """Decide whether `others` lead from one end of a stretch to its other end, even if any one of
    them is closed.
    """
    start, end = stretch
    detour = _route(others, start, end)
    if not detour:
        return False

    for closed in detour:
        rest = [other for other in others if other != closed]
        if not _route(rest, start, end):
            return False

    return True


def _route(stretches: list[Stretch], start: Crossing, end: Crossing) -> list[Stretch]:
    """Find the fewest stretches that lead from a crossing to another, none if no way does."""
    leads: dict[Crossing, list[Stretch]] = {}
    for stretch in stretches:
        for crossing in stretch:
            leads.setdefault(crossing, []).append(stretch)

    by: dict[Crossing, Stretch] = {}
    waiting = deque([start])
    while waiting and end not in by:
        here = waiting.popleft()
        for stretch in leads.get(here, ()):
            there = _other_end(stretch, here)
            if there != start and there not in by:
                by[there] = stretch
                waiting.append(there)

    route: list[Stretch] = []
    here = end
    while here in by:
        route.append(by[here])
        here = _other_end(by[here], here)

    return route


def _other_end(stretch: Stretch, crossing: Crossing) -> Crossing:
    first, second = stretch
    return second if crossing == first else first


def _dead_ends(
    rng: np.random.Generator, grid: Grid, missing: list[Stretch], names: _Names
) -> list[Road]:
    """Lay alleys into every other of the missing stretches, and two that lead out of the town."""
    roads: list[Road] = []
    for stretch in missing[::2]:
        share = float(rng.uniform(*DEAD_END_SHARE))
        first, second = stretch if rng.random() < 0.5 else stretch[::-1]

        start_x, start_y = grid.at(first)
        end_x, end_y = grid.at(second)
        x_m = start_x + share * (end_x - start_x)
        y_m = start_y + share * (end_y - start_y)
        end = (round(x_m, 1), round(y_m, 1))
        name = names.dead_end(len(roads))
        roads.append(Road(name, grid.at(first), end, ALLEY_M))

    for sign in (-1.0, 1.0):
        # From the western (-1) or eastern (1) border.
        border = 0 if sign < 0 else len(grid.x_m) - 1
        start = grid.at((border, int(rng.integers(len(grid.y_m)))))
        start_x, y_m = start
        end = (round(start_x + sign * float(rng.uniform(*OUTWARD_M)), 1), y_m)
        name = names.dead_end(len(roads))
        roads.append(Road(name, start, end, ALLEY_M))

    return roads


def _square(rng: np.random.Generator, grid: Grid) -> Road:
    """Lay a square around one of the inner crossings: a short road that is as wide as long."""
    column = int(rng.integers(1, len(grid.x_m) - 1))
    row = int(rng.integers(1, len(grid.y_m) - 1))
    x_m, y_m = grid.at((column, row))

    width_m = round(float(rng.uniform(*SQUARE_M)), 1)
    half_line_m = 2.0
    west = (x_m - half_line_m, y_m)
    east = (x_m + half_line_m, y_m)

    return Road(SQUARE_NAME, west, east, width_m)
