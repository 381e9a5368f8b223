"""Travelling salesman problems and tours as TSPLIB writes them (Reinelt 1991), plain or packed by
xz.

Lengths are rounded exactly as TSPLIB95 prescribes, so that published optima can be compared with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.lines import wrong_line
from cogmap.data.pose_graph import numbered_lines
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats, Indices

EUC_2D = "EUC_2D"
ATT = "ATT"
GEO = "GEO"
WEIGHT_TYPES = (EUC_2D, ATT, GEO)
SUFFIXES = (".tsp", ".tsp.xz")
TOUR_SUFFIXES = (".opt.tour", ".opt.tour.xz")

_WEIGHT_TYPE = "EDGE_WEIGHT_TYPE"
_COORDINATES = "NODE_COORD_SECTION"
_TOUR = "TOUR_SECTION"
_END = "EOF"
_TOUR_END = -1
# TSPLIB's own value of pi: with another one, some lengths come out one kilometre different.
_GEO_PI = 3.141592
_GEO_RADIUS_KM = 6378.388

Line = tuple[int, str]


class UnsupportedProblemError(UsageError):
    """A problem whose lengths are of a type that is not read."""


@dataclass(frozen=True, eq=False)
class Problem:
    """`positions` (n, 2) as in the file.

    `weight_type` is one of WEIGHT_TYPES. With GEO, positions are latitude and longitude, in degrees
    and minutes: DDD.MM.
    """

    name: str
    weight_type: str
    positions: Floats

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def lengths(self) -> Floats:
        """(n, n): between the positions, rounded to whole numbers as the type prescribes."""
        return lengths(self.positions, self.weight_type)


class Folder(NamedTuple):
    """The problems of a folder, and for each file whose type is not read, why."""

    problems: list[Problem]
    left_out: list[str]


@dataclass(frozen=True)
class _File:
    """The key words of a file, each with the line it stands on, and the lines of its section."""

    path: Path
    keys: dict[str, tuple[Line, str]]
    section: list[Line]

    def value(self, key: str) -> str:
        """The value of a key word. Raises UsageError where it is missing."""
        if key not in self.keys:
            raise UsageError(f"{self.path} has no line {key}: give a whole TSPLIB file")

        _, value = self.keys[key]
        return value

    def wrong(self, key: str, expected: str) -> UsageError:
        """The error for the line of a key word that is there."""
        (number, line), _ = self.keys[key]
        return wrong_line(self.path, number, line, expected)


def read(path: Path) -> Problem:
    """The problem in a file.

    Raises UsageError naming file and line where something is wrong, UnsupportedProblemError where
    its lengths are of another type.
    """
    file = _read(path, _COORDINATES)
    weight_type = file.value(_WEIGHT_TYPE)
    return Problem(stem(path), weight_type, _positions(file))


def read_tour(path: Path) -> Indices:
    """The order (n,) of the nodes in a file of a tour, counted from 0.

    Raises UsageError naming file and line where a node is missing, unknown or visited twice.
    """
    file = _read(path, _TOUR)
    dimension = _dimension(file)
    visited: dict[int, None] = {}

    for number, line, node in _nodes(file):
        if not 1 <= node <= dimension or node in visited:
            expected = f"a node from 1 to {dimension} that was not visited before"
            raise wrong_line(path, number, line, expected)
        visited[node] = None

    if len(visited) != dimension:
        raise UsageError(f"{path} visits {len(visited)} of {dimension} nodes: give a whole tour")
    return np.array(list(visited), np.int64) - 1


def _nodes(file: _File) -> Iterator[tuple[int, str, int]]:
    """The nodes of a tour, each with the line that it stands on; 0 for what is no number."""
    for number, line in file.section:
        for word in line.split():
            node = int(word) if word.lstrip("-").isdigit() else 0
            if node != _TOUR_END:
                yield number, line, node


def folder(path: Path) -> Folder:
    """The TSPLIB files in a folder, by name. Raises UsageError where none can be read."""
    if not path.is_dir():
        raise UsageError(f"there is no folder {path}: give one with TSPLIB files")

    found = Folder([], [])
    for file in sorted(path.iterdir()):
        if not file.name.endswith(SUFFIXES):
            continue
        try:
            found.problems.append(read(file))
        except UnsupportedProblemError as error:
            found.left_out.append(str(error))

    if not found.problems:
        types = ", ".join(WEIGHT_TYPES)
        raise UsageError(f"{path} has no {' or '.join(SUFFIXES)} of the types {types}: give one")
    return found


def optimal_tour(path: Path, problem: Problem) -> Indices | None:
    """The tour that a folder gives as the shortest of a problem, NAME.opt.tour; None without one.

    Raises UsageError where it is a tour of another number of nodes.
    """
    for suffix in TOUR_SUFFIXES:
        file = path / f"{problem.name}{suffix}"
        if file.exists():
            tour = read_tour(file)
            if len(tour) != len(problem):
                raise UsageError(
                    f"{file} has {len(tour)} nodes, {problem.name} {len(problem)}: "
                    "give the tour of that problem"
                )
            return tour

    return None


def stem(path: Path) -> str:
    """The name of a file without what tells its kind: berlin52 of berlin52.tsp.xz."""
    name, _, _ = path.name.partition(".")
    return name


def lengths(positions: Floats, weight_type: str) -> Floats:
    """(n, n): between (n, 2) positions, rounded as TSPLIB95 prescribes for the type."""
    if weight_type == GEO:
        return _geo_km(positions)

    distances = straight(positions)
    if weight_type == ATT:
        pseudo = np.sqrt(np.square(distances) / 10.0)
        rounded = np.floor(pseudo + 0.5)
        return np.where(rounded < pseudo, rounded + 1.0, rounded)

    return np.floor(distances + 0.5)


def straight(positions: Floats) -> Floats:
    """(n, n): straight distances between (n, 2) positions, not rounded."""
    offsets = positions[:, None] - positions
    squared = np.square(offsets)
    return np.asarray(np.sqrt(squared.sum(axis=-1)))


def _geo_km(positions: Floats) -> Floats:
    """(n, n): whole kilometres along great circles between latitudes and longitudes as DDD.MM."""
    latitude, longitude = _geo_radians(positions).T
    across = np.cos(longitude[:, None] - longitude)
    apart = np.cos(latitude[:, None] - latitude)
    opposite = np.cos(latitude[:, None] + latitude)
    cosine = 0.5 * ((1.0 + across) * apart - (1.0 - across) * opposite)

    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    distances_km = np.floor(_GEO_RADIUS_KM * angle + 1.0)
    np.fill_diagonal(distances_km, 0.0)
    return np.asarray(distances_km)


def _geo_radians(positions: Floats) -> Floats:
    """(n, 2), of latitudes and longitudes as DDD.MM."""
    degrees = np.trunc(positions)
    minutes = positions - degrees
    decimal = degrees + 5.0 * minutes / 3.0
    return np.asarray(_GEO_PI * decimal / 180.0)


def _read(path: Path, section: str) -> _File:
    """The key words before `section`, and its lines. Raises UsageError where it is not there."""
    lines = numbered_lines(path)
    keys: dict[str, tuple[Line, str]] = {}

    for number, line in lines:
        key, colon, value = line.partition(":")
        if line.strip() == section:
            return _File(path, keys, list(_until_end(lines)))
        if key.strip() == _WEIGHT_TYPE and value.strip() not in WEIGHT_TYPES:
            expected = f"one of {', '.join(WEIGHT_TYPES)}"
            raise UnsupportedProblemError(str(wrong_line(path, number, line, expected)))
        if colon:
            keys[key.strip()] = ((number, line), value.strip())
        elif line.strip():
            raise wrong_line(path, number, line, f"KEY : VALUE, or {section}")

    raise UsageError(f"{path} has no {section}: give a TSPLIB file with one")


def _until_end(lines: Iterator[Line]) -> Iterator[Line]:
    for number, line in lines:
        if line.strip() == _END:
            return
        if line.strip():
            yield number, line


def _dimension(file: _File) -> int:
    value = file.value("DIMENSION")
    if not value.isdigit() or int(value) < 1:
        raise file.wrong("DIMENSION", "a number of nodes, 1 at least")
    return int(value)


def _positions(file: _File) -> Floats:
    """(n, 2), a line each: the node's number, counted from 1 in order, and two coordinates."""
    dimension = _dimension(file)
    rows: list[tuple[float, float]] = []

    for number, line in file.section:
        rows.append(_position(file.path, number, line, len(rows) + 1))

    if len(rows) != dimension:
        raise file.wrong("DIMENSION", f"{len(rows)}, the number of nodes in the file")
    return np.array(rows)


def _position(path: Path, number: int, line: str, node: int) -> tuple[float, float]:
    """The coordinates of a line that begins with `node`."""
    words = line.split()
    try:
        x, y = map(float, words[1:])
    except ValueError:
        x = y = math.nan

    if words[0] != str(node) or not math.isfinite(x) or not math.isfinite(y):
        raise wrong_line(path, number, line, f"{node} and two coordinates")
    return x, y
