"""Tours that people drew of problems: GraphN.lib, as TSPLIB writes them, and tours.csv.

A row of it is a tour: the number of its graph, of its participant, and x and y of the nodes in the
order of the visit. Other columns are ignored.
"""

from __future__ import annotations

from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import Line, cells_of, numbered_lines, plain_or_packed
from cogmap.data.tsplib import Problem, read
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Indices

TOURS = "tours.csv"
COLUMNS = ("graph", "participant", "x", "y")
_GRAPHS = "Graph*.lib"


class HumanTours(NamedTuple):
    """A problem, and the order (n,) in which each of its participants visited the nodes."""

    problem: Problem
    tours: list[Indices]


def read_folder(folder: Path) -> list[HumanTours]:
    """Read every problem of a folder that somebody drew a tour of, by its name.

    Raises UsageError naming file and line of a row that is no tour of its problem.
    """
    graphs = sorted(folder.glob(_GRAPHS))
    if not graphs:
        raise UsageError(f"{folder} has no {_GRAPHS}: give a folder of problems and people's tours")
    path = plain_or_packed(folder, TOURS)
    if path is None:
        raise UsageError(f"{folder} has no {TOURS}, plain or packed: put people's tours there")

    problems = [read(graph) for graph in graphs]
    by_number = {problem.name.removeprefix("Graph"): problem for problem in problems}
    tours: dict[str, list[Indices]] = defaultdict(list)

    lines = numbered_lines(path, "people's tours as CSV")
    header = next(lines, Line(path, 1, ""))
    names = _values(header)
    if not set(COLUMNS) <= set(names):
        raise header.wrong(f"the columns {', '.join(COLUMNS)}")

    for line in lines:
        row = dict(zip(names, _values(line), strict=False))
        graph = row.get("graph", "")
        if graph not in by_number:
            raise line.wrong(f"a graph of the folder: {', '.join(by_number)}")

        problem = by_number[graph]
        nodes_at: dict[tuple[float, float], list[int]] = defaultdict(list)
        for node, (x, y) in enumerate(problem.positions.tolist()):
            nodes_at[x, y].append(node)

        # Of nodes at one place, which one was meant makes no difference.
        visited: list[int] = []
        with suppress(KeyError, ValueError, IndexError):
            x_values = map(float, row["x"].split(","))
            y_values = map(float, row["y"].split(","))
            visited = [nodes_at[place].pop(0) for place in zip(x_values, y_values, strict=True)]
        if len(visited) != len(problem):
            raise line.wrong(f"a tour past every node of graph {graph}, once")
        tours[graph].append(np.array(visited, np.int64))

    return [HumanTours(by_number[number], tours[number]) for number in by_number if tours[number]]


def _values(line: Line) -> list[str]:
    return cells_of(line)
