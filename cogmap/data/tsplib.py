"""Travelling salesman problems and tours as TSPLIB writes them (Reinelt 1991).

Lengths are rounded exactly as TSPLIB95 prescribes, so that published optima can be compared with.
"""

from __future__ import annotations

import logging
import math
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import PACKED, Line, number_of, numbered_lines, plain_or_packed
from cogmap.errors import UsageError
from cogmap.files.bounds import Budget
from cogmap.geometry.arrays import Floats, Indices

EUC_2D = "EUC_2D"
ATT = "ATT"
GEO = "GEO"
WEIGHT_TYPES = (EUC_2D, ATT, GEO)
SUFFIXES = tuple(f".tsp{packed}" for packed in PACKED)
TOUR_SUFFIX = ".opt.tour"

_WEIGHT_TYPE = "EDGE_WEIGHT_TYPE"
_DIMENSION = "DIMENSION"
_COORDINATES = "NODE_COORD_SECTION"
_TOUR = "TOUR_SECTION"
# Sections that leave a problem what it is; any other, such as FIXED_EDGES_SECTION, changes it.
_PLAIN_SECTIONS = (_COORDINATES, "DISPLAY_DATA_SECTION")
_SECTION_END = "-1"
# TSPLIB95, section 1.1: they are known without their colon, too.
_KEYS = (
    *("NAME", "TYPE", "COMMENT", "DIMENSION", "CAPACITY"),
    *("EDGE_WEIGHT_TYPE", "EDGE_WEIGHT_FORMAT", "EDGE_DATA_FORMAT"),
    *("NODE_COORD_TYPE", "DISPLAY_DATA_TYPE"),
)
_KEY = re.compile(r"\s*([A-Za-z]\w*)\s*(:?)\s*(.*)")
# TSPLIB's own value of pi: with another one, some lengths come out one kilometre different.
_GEO_PI = 3.141592
_GEO_RADIUS_KM = 6378.388
# What the length between two nodes takes while lengths are computed.
_LENGTH_BYTES = 48
log = logging.getLogger("cogmap")


class UnsupportedProblemError(UsageError):
    """A problem of a kind that is not read."""


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
        """Return the positions' distances (n, n), rounded to whole numbers as the type asks."""
        return lengths(self.positions, self.weight_type)


class Folder(NamedTuple):
    """The problems of a folder, and why each of the others was left out."""

    problems: list[Problem]
    left_out: list[str]


class _File:
    """A file's key words, each with its line and value, and its sections, line by line.

    A section's name, with or without a colon, begins a section; lines that are no key word belong
    to the section before them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[str, tuple[Line, str]] = {}
        self.sections: dict[str, list[Line]] = {}
        section: list[Line] | None = None

        for line in numbered_lines(path, "a TSPLIB file"):
            found = _KEY.fullmatch(line.text)
            key = found[1].upper() if found else ""
            if key == "EOF":
                break
            if key.endswith("_SECTION"):
                self.values[key] = line, ""
                section = self.sections.setdefault(key, [])
            elif found and (key in _KEYS or found[2]):
                self.values[key] = line, found[3].strip()
                section = None
            elif section is not None and line.text.strip():
                section.append(line)
            elif line.text.strip():
                raise line.wrong(f"KEY : VALUE, or {_COORDINATES}")

    def section(self, name: str) -> list[Line]:
        """Return the lines of a section up to a line -1. Raises UsageError if it is missing."""
        if name not in self.sections:
            raise UsageError(f"{self.path} has no {name}: give a TSPLIB file with one")

        rows = []
        for line in self.sections[name]:
            if line.text.strip() == _SECTION_END:
                break
            rows.append(line)
        return rows

    def dimension(self) -> int:
        """Return the number of nodes. Raises UsageError if it is missing, or none."""
        if _DIMENSION not in self.values:
            raise UsageError(f"{self.path} has no line {_DIMENSION}: give a whole TSPLIB file")

        line, value = self.values[_DIMENSION]
        dimension = number_of(value)
        if not dimension:
            raise line.wrong("a number of nodes, 1 at least")
        return dimension


def read(path: Path) -> Problem:
    """Read the problem in a file, plain or packed.

    Raises UsageError naming file, line and remedy; UnsupportedProblemError for one of another kind.
    """
    file = _File(path)
    if _WEIGHT_TYPE not in file.values:
        raise UsageError(f"{path} has no line {_WEIGHT_TYPE}: give a whole TSPLIB file")
    type_line, value = file.values[_WEIGHT_TYPE]
    weight_type, *_ = value.split() or [""]
    if weight_type not in WEIGHT_TYPES:
        raise _unsupported(type_line, f"one of {', '.join(WEIGHT_TYPES)}")
    for name in file.sections:
        if name not in _PLAIN_SECTIONS:
            raise _unsupported(file.values[name][0], f"no section but {_COORDINATES}")

    rows: list[tuple[float, float]] = []
    for node, line in enumerate(file.section(_COORDINATES), start=1):
        words = line.text.split()
        try:
            x, y = map(float, words[1:])
        except ValueError:
            x = y = math.nan
        if words[0] != str(node) or not math.isfinite(x) or not math.isfinite(y):
            raise line.wrong(f"{node} and two coordinates", "number the nodes from 1, in order")
        rows.append((x, y))

    if len(rows) != file.dimension():
        line, _ = file.values[_DIMENSION]
        raise line.wrong(f"{len(rows)}, the number of nodes in the file")
    Budget(path, "takes, with the lengths between its nodes,").check(_LENGTH_BYTES * len(rows) ** 2)
    return Problem(stem(path), weight_type, np.array(rows))


def _unsupported(line: Line, expected: str) -> UnsupportedProblemError:
    return UnsupportedProblemError(str(line.wrong(expected, "such problems are not read")))


def read_tour(path: Path) -> Indices:
    """Read the order (n,) of the nodes in a file of a tour, counted from 0.

    Raises UsageError naming file and line for a node that is missing, unknown or visited twice.
    """
    file = _File(path)
    words = [(line, word) for line in file.section(_TOUR) for word in line.text.split()]
    words = [(line, word) for line, word in words if word != _SECTION_END]
    dimension = file.dimension() if _DIMENSION in file.values else len(words)
    visited: dict[int, None] = {}

    for line, word in words:
        node = number_of(word) or 0
        if not 1 <= node <= dimension or node in visited:
            raise line.wrong(f"a node from 1 to {dimension} that was not visited before")
        visited[node] = None

    if len(visited) != dimension:
        raise UsageError(f"{path} visits {len(visited)} of {dimension} nodes: give a whole tour")
    return np.array(list(visited), np.int64) - 1


def folder(path: Path) -> Folder:
    """Read the TSPLIB files in a folder, by name; those of a kind that is not read are left out,
    with a warning. Raises UsageError if none can be read.
    """
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
            log.warning("left out: %s", error)

    if not found.problems:
        types = ", ".join(WEIGHT_TYPES)
        raise UsageError(f"{path} has no .tsp, plain or packed, of the types {types}: give one")
    return found


def optimal_tour(path: Path, problem: Problem) -> Indices | None:
    """Read the tour that a folder has as the shortest of a problem, NAME.opt.tour; None without
    one.

    Raises UsageError if it is a tour of another number of nodes.
    """
    file = plain_or_packed(path, f"{problem.name}{TOUR_SUFFIX}")
    if file is None:
        return None

    tour = read_tour(file)
    if len(tour) != len(problem):
        raise UsageError(
            f"{file} has {len(tour)} nodes, {problem.name} {len(problem)}: "
            "give the tour of that problem"
        )
    return tour


def stem(path: Path) -> str:
    """Return the name of a file without what describes its kind: berlin52 of berlin52.tsp.xz."""
    name, _, _ = path.name.partition(".")
    return name


def lengths(positions: Floats, weight_type: str) -> Floats:
    """Compute distances (n, n) of (n, 2) positions, rounded as TSPLIB95 prescribes for the type."""
    if weight_type == GEO:
        return great_circle_km(positions)

    distances = straight(positions)
    if weight_type == ATT:
        pseudo = np.sqrt(np.square(distances) / 10.0)
        rounded = np.floor(pseudo + 0.5)
        return np.where(rounded < pseudo, rounded + 1.0, rounded)

    return np.floor(distances + 0.5)


def straight(positions: Floats) -> Floats:
    """Compute the straight distances (n, n) between (n, 2) positions, not rounded."""
    offsets = positions[:, None] - positions
    squared = np.square(offsets)
    return np.asarray(np.sqrt(squared.sum(axis=-1)))


def great_circle_km(positions: Floats) -> Floats:
    """Compute great-circle distances (n, n), in whole km, of latitudes and longitudes as DDD.MM."""
    degrees = np.trunc(positions)
    minutes = positions - degrees
    latitude, longitude = (_GEO_PI * (degrees + 5.0 * minutes / 3.0) / 180.0).T

    across = np.cos(longitude[:, None] - longitude)
    apart = np.cos(latitude[:, None] - latitude)
    opposite = np.cos(latitude[:, None] + latitude)
    cosine = 0.5 * ((1.0 + across) * apart - (1.0 - across) * opposite)

    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    distances_km = np.floor(_GEO_RADIUS_KM * angle + 1.0)
    np.fill_diagonal(distances_km, 0.0)
    return np.asarray(distances_km)
