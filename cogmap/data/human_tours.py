"""Tours that people drew of problems: GraphN.lib, as TSPLIB writes them, and tours.csv, plain or
packed by xz.

A row of it is a tour: the number of its graph, of its participant, and x and y of the nodes in the
order of the visit. Other columns are ignored.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.lines import wrong_line
from cogmap.data.pose_graph import numbered_lines
from cogmap.data.tsplib import Problem, read
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Indices

TOURS = ("tours.csv", "tours.csv.xz")
COLUMNS = ("graph", "participant", "x", "y")
_GRAPHS = "Graph*.lib"
Nodes = dict[tuple[float, float], int]


class HumanTours(NamedTuple):
    """A problem, and the order (n,) in which each of its participants visited the nodes."""

    problem: Problem
    tours: list[Indices]


def read_folder(folder: Path) -> list[HumanTours]:
    """Every problem of a folder that somebody drew a tour of, by its name.

    Raises UsageError naming file and line where a row is no tour of its problem.
    """
    graphs = sorted(folder.glob(_GRAPHS))
    if not graphs:
        raise UsageError(f"{folder} has no {_GRAPHS}: give a folder of problems and people's tours")

    problems = [read(path) for path in graphs]
    by_number = {problem.name.removeprefix("Graph"): problem for problem in problems}
    tours = _tours(_tours_file(folder), by_number)

    found = []
    for problem in problems:
        if tours[problem.name]:
            found.append(HumanTours(problem, tours[problem.name]))
    return found


def _tours_file(folder: Path) -> Path:
    for name in TOURS:
        path = folder / name
        if path.exists():
            return path
    raise UsageError(f"{folder} has no {' or '.join(TOURS)}: put people's tours there")


def _tours(path: Path, problems: Mapping[str, Problem]) -> dict[str, list[Indices]]:
    """The tours of a file, by the name of their problem."""
    nodes = {number: _nodes(problem) for number, problem in problems.items()}
    tours: dict[str, list[Indices]] = {problem.name: [] for problem in problems.values()}

    for number, line, row in _rows(path):
        graph = row.get("graph", "")
        if graph not in problems:
            raise wrong_line(path, number, line, f"a graph of the folder: {', '.join(problems)}")

        tour = _tour(row, nodes[graph])
        if tour is None:
            raise wrong_line(path, number, line, f"a tour past every node of graph {graph}, once")
        tours[problems[graph].name].append(tour)

    return tours


def _rows(path: Path) -> Iterator[tuple[int, str, Mapping[str, str]]]:
    """Each line after the first, its number, and its values by column."""
    lines = numbered_lines(path)
    number, header = next(lines, (1, ""))
    names = _values(header)
    if not set(COLUMNS) <= set(names):
        raise wrong_line(path, number, header, f"the columns {', '.join(COLUMNS)}")

    for number, line in lines:
        values = _values(line)
        row = zip(names, values, strict=False)
        yield number, line, dict(row)


def _values(line: str) -> list[str]:
    return next(csv.reader([line]), [])


def _nodes(problem: Problem) -> Nodes:
    """The number of each node, counted from 0, by its position."""
    nodes: Nodes = {}
    for node, (x, y) in enumerate(problem.positions.tolist()):
        nodes[x, y] = node
    return nodes


def _tour(row: Mapping[str, str], nodes: Nodes) -> Indices | None:
    """The nodes in the order of a row; None where it does not visit each once."""
    try:
        x = [float(word) for word in row["x"].split(",")]
        y = [float(word) for word in row["y"].split(",")]
        visited = [nodes[position] for position in zip(x, y, strict=True)]
    except (KeyError, ValueError):
        return None

    if sorted(visited) != sorted(nodes.values()):
        return None
    return np.array(visited, np.int64)
