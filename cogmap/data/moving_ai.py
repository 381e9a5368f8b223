"""Grid maps and route problems in the MovingAI format, plain or packed by gzip, bzip2 or xz.

Sturtevant (2012), doi 10.1109/TCIAIG.2012.2197681. A cell (x, y) is column x of row y, as in the
files. Lengths are octile: 1 to a neighbour beside, the square root of 2 to one across, and no
corner is cut.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.lines import wrong_line
from cogmap.data.packed import lines
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Booleans

PASSABLE = frozenset(".GS")
KNOWN = PASSABLE | frozenset("@OTW")
HEADER = ("type octile", "height and a number", "width and a number", "map")
MAX_CELLS = 1 << 28
_FIELDS = 9
_MAP = "a grid map in the MovingAI format (.map)"
_SCENARIO = "route problems in the MovingAI format (.scen)"


class Problem(NamedTuple):
    """A route to find between two cells (x, y), and the length of the shortest, in cells."""

    start: tuple[int, int]
    goal: tuple[int, int]
    optimal: float


def read_map(path: Path) -> Booleans:
    """(width, height): which cells of the map in a file can be passed.

    Raises UsageError naming the file and the line that is wrong.
    """
    numbered = _numbered(path, _MAP)
    width, height = _size(path, numbered)

    is_passable = np.zeros((width, height), bool)
    for y in range(height):
        number, line = _next(path, numbered, f"row {y + 1} of {height}")
        if len(line) != width or not KNOWN.issuperset(line):
            raise wrong_line(path, number, line, f"{width} cells out of . G S @ O T W")

        is_passable[:, y] = [cell in PASSABLE for cell in line]

    return is_passable


def read_problems(path: Path, is_passable: Booleans) -> list[Problem]:
    """The problems in a file, for the map `is_passable` (width, height).

    Raises UsageError naming the file and the line that is wrong.
    """
    numbered = _numbered(path, _SCENARIO)
    number, line = _next(path, numbered, "version 1")
    if line.split() not in (["version", "1"], ["version", "1.0"]):
        raise wrong_line(path, number, line, "version 1")

    problems = []
    for number, line in numbered:
        if line.strip():
            problems.append(_problem(path, number, line, is_passable))
    if not problems:
        raise UsageError(f"{path} has no problem: give {_SCENARIO}")

    return problems


def _problem(path: Path, number: int, line: str, is_passable: Booleans) -> Problem:
    # The second field is a map's name, which may have spaces.
    fields = line.rsplit(maxsplit=_FIELDS - 2)
    try:
        width, height, start_x, start_y, goal_x, goal_y = map(int, fields[1:-1])
        optimal = float(fields[-1])
    except (ValueError, IndexError):
        expected = "bucket, map, width, height, start x y, goal x y and the optimal length"
        raise wrong_line(path, number, line, expected) from None

    if (width, height) != is_passable.shape:
        map_width, map_height = is_passable.shape
        expected = f"a problem for a map of {map_width} x {map_height} cells"
        raise wrong_line(path, number, line, expected)
    if not math.isfinite(optimal) or optimal < 0:
        raise wrong_line(path, number, line, "an optimal length that is finite and not below 0")

    problem = Problem((start_x, start_y), (goal_x, goal_y), optimal)
    for x, y in (problem.start, problem.goal):
        if not _can_pass(is_passable, x, y):
            raise wrong_line(path, number, line, f"({x}, {y}) to be a passable cell of the map")

    return problem


def _can_pass(is_passable: Booleans, x: int, y: int) -> bool:
    """Whether a cell lies on the map and can be passed."""
    width, height = is_passable.shape
    is_inside = 0 <= x < width and 0 <= y < height
    return is_inside and bool(is_passable[x, y])


def _size(path: Path, numbered: Iterator[tuple[int, str]]) -> tuple[int, int]:
    """The width and height that the header of a map states."""
    sizes = {}
    for expected in HEADER:
        number, line = _next(path, numbered, expected)
        words = line.split()
        key = expected.split()[0]
        if key in ("height", "width"):
            if len(words) != 2 or words[0] != key or not words[1].isdecimal():
                raise wrong_line(path, number, line, expected)
            sizes[key] = int(words[1])
        elif words != expected.split():
            raise wrong_line(path, number, line, expected)

    width = sizes["width"]
    height = sizes["height"]
    if not 0 < width * height <= MAX_CELLS:
        raise UsageError(f"{path} has {width} x {height} cells: give a map of 1 to {MAX_CELLS}")
    return width, height


def _numbered(path: Path, give: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(lines(path, give), start=1):
        yield number, line.decode("latin-1").rstrip("\r\n")


def _next(path: Path, numbered: Iterator[tuple[int, str]], expected: str) -> tuple[int, str]:
    try:
        return next(numbered)
    except StopIteration:
        raise UsageError(f"{path} ends where it should have {expected}: give all of it") from None
