"""Grid maps and route problems in the MovingAI format.

Sturtevant (2012), doi 10.1109/TCIAIG.2012.2197681. A cell (x, y) is column x of row y, as in the
files. Lengths are octile: 1 to a neighbour beside, the square root of 2 to one across, and no
corner is cut.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import Line, number_of, numbered_lines
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Booleans, Bytes

PASSABLE = frozenset(".GS")
KNOWN = PASSABLE | frozenset("@OTW")
HEADER = {"type": "type octile", "height": "height and a number", "width": "width and a number"}
VERSIONS = (["version", "1"], ["version", "1.0"])
# A quarter of a gigabyte, a byte a cell; and the fields of a problem's line, by the format.
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
    """Read a map, (width, height): which of its cells can be passed.

    Raises UsageError naming file, line and remedy.
    """
    lines = numbered_lines(path, _MAP)
    sizes: dict[str, int] = {}
    for line in lines:
        words = line.text.split()
        if words == ["map"]:
            break

        key, value = words if len(words) == 2 else ("", "")
        size = number_of(value)
        if key in ("width", "height") and size is not None:
            sizes[key] = size
        elif words != ["type", "octile"]:
            raise line.wrong(HEADER.get(key, f"{', '.join(HEADER.values())}, or map"))

    if len(sizes) < 2:
        raise UsageError(f"{path} has no height or no width before its map: give {_MAP}")
    width, height = sizes["width"], sizes["height"]
    if not 0 < width * height <= MAX_CELLS:
        raise UsageError(f"{path} has {width} x {height} cells: give a map of 1 to {MAX_CELLS}")

    # Rows that are there, not those that the head promises.
    rows: list[Bytes] = []

    for line in lines:
        cells = line.text.rstrip()
        if len(rows) == height:
            if cells:
                raise line.wrong(f"the end after {height} rows", "make height their number")
            continue
        if len(cells) != width or not KNOWN.issuperset(cells):
            raise line.wrong(f"{width} cells out of . G S @ O T W", "mend the row, or width")

        rows.append(np.frombuffer(cells.encode(), np.uint8))

    if len(rows) < height:
        raise UsageError(f"{path} ends before row {len(rows) + 1} of {height}: give all of it")
    passable = np.frombuffer("".join(PASSABLE).encode(), np.uint8)
    return np.isin(np.stack(rows, axis=1), passable)


def read_problems(path: Path, is_passable: Booleans) -> list[Problem]:
    """Read the problems in a file, for the map `is_passable` (width, height).

    Raises UsageError naming file, line and remedy.
    """
    lines = numbered_lines(path, _SCENARIO)
    first = next(lines, Line(path, 1, ""))
    if first.text.split() not in VERSIONS:
        raise first.wrong("version 1", f"give {_SCENARIO}")

    map_width, map_height = is_passable.shape
    problems = []
    for line in lines:
        if not line.text.strip():
            continue

        # The second field is a map's name, which may have spaces.
        fields = line.text.rsplit(maxsplit=_FIELDS - 2)
        try:
            width, height, start_x, start_y, goal_x, goal_y = map(int, fields[1:-1])
            optimal = float(fields[-1])
        except (ValueError, IndexError):
            expected = "bucket, map, width, height, start x y, goal x y and the optimal length"
            raise line.wrong(expected) from None

        if (width, height) != (map_width, map_height):
            expected = f"a problem for a map of {map_width} x {map_height} cells"
            raise line.wrong(expected, "give the map of these problems")
        if not math.isfinite(optimal) or optimal < 0:
            raise line.wrong("an optimal length that is finite and not below 0")

        problem = Problem((start_x, start_y), (goal_x, goal_y), optimal)
        for x, y in (problem.start, problem.goal):
            is_inside = 0 <= x < width and 0 <= y < height
            if not is_inside or not is_passable[x, y]:
                expected = f"({x}, {y}) to be a passable cell of the map"
                raise line.wrong(expected, "remove the problem, or give the map that it is of")
        problems.append(problem)

    if not problems:
        raise UsageError(f"{path} has no problem: give {_SCENARIO}")
    return problems
