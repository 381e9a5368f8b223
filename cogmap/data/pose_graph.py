"""Pose graphs that others recorded: poses in the plane, and what was measured between them."""

from __future__ import annotations

import lzma
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cogmap.data.lines import wrong_line
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats, Indices

Order = tuple[tuple[int, int], ...]
POSE = "pose"
EDGE = "edge"
EXPECTED = {
    POSE: "an id, x, y and heading: 4 numbers",
    EDGE: "two ids, dx, dy, dheading and 6 entries of an information matrix: 11 numbers",
}
NUMBERS = {POSE: (1, 4), EDGE: (2, 11)}
_FIRST_ENTRY = 5
_TRUE_POSE = "x, y and heading, with an index before them or not"


@dataclass(frozen=True)
class PoseGraphFile:
    """`poses` (n, 3) in the order of `ids`; edge k measures pose `j[k]` as seen from
    `i[k]`, both indices.

    `measurement` (m, 3) is metres, metres, radians; `information` (m, 3, 3) the inverse of its
    covariance.
    """

    ids: Indices
    poses: Floats
    i: Indices
    j: Indices
    measurement: Floats
    information: Floats


@dataclass
class _Rows:
    """The numbers of the lines read so far, ids first; `index` is where a pose of that id stands.

    `edge_lines` are the numbers of the lines that the edges stand on.
    """

    poses: list[list[float]] = field(default_factory=list)
    edges: list[list[float]] = field(default_factory=list)
    edge_lines: list[int] = field(default_factory=list)
    index: dict[int, int] = field(default_factory=dict)


def numbered_lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a text file, or of one packed by xz, counted from 1. Raises UsageError where it
    cannot be read.
    """
    try:
        with lzma.open(path, "rt") if path.suffix == ".xz" else path.open() as lines:
            yield from enumerate(lines, 1)
    except FileNotFoundError:
        raise UsageError(f"there is no file {path}") from None
    except (OSError, UnicodeDecodeError, lzma.LZMAError, EOFError) as error:
        raise UsageError(f"cannot read {path} as text: {error}") from None


def read_graph(path: Path, kinds: Mapping[str, str], order: Order) -> PoseGraphFile:
    """A pose graph of lines that begin with one of the words `kinds`, each for a POSE or an EDGE.

    `order` is where in the matrix the six numbers of information stand. Raises UsageError naming
    file and line.
    """
    rows = _Rows()
    for number, line in numbered_lines(path):
        word, *rest = line.split() or ["#"]
        if word.startswith("#"):
            continue
        if word not in kinds:
            raise wrong_line(path, number, line, f"a line that begins with {' or '.join(kinds)}")

        kind = kinds[word]
        values = _numbers(path, number, line, rest, kind)
        if kind == EDGE:
            rows.edges.append(values)
            rows.edge_lines.append(number)
            continue

        identifier = int(values[0])
        if identifier in rows.index:
            raise wrong_line(path, number, line, "a pose whose id has not been there before")
        rows.index[identifier] = len(rows.poses)
        rows.poses.append(values)

    if not rows.poses or not rows.edges:
        raise UsageError(
            f"{path} has {len(rows.poses)} poses and {len(rows.edges)} edges: a graph needs both"
        )
    return _graph(path, rows, order)


def _numbers(path: Path, number: int, line: str, words: Iterable[str], kind: str) -> list[float]:
    """The numbers of a line of that kind. Raises UsageError where they are others."""
    ids, expected = NUMBERS[kind]
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise wrong_line(path, number, line, EXPECTED[kind]) from None

    has_whole_ids = all(value.is_integer() for value in values[:ids])
    if len(values) != expected or not has_whole_ids or not np.isfinite(values).all():
        raise wrong_line(path, number, line, EXPECTED[kind])
    return values


def _graph(path: Path, rows: _Rows, order: Order) -> PoseGraphFile:
    ends = _ends(path, rows)
    poses = np.array(rows.poses)
    edges = np.array(rows.edges)

    information = np.empty((len(edges), 3, 3))
    for column, (row, across) in enumerate(order, _FIRST_ENTRY):
        information[:, row, across] = edges[:, column]
        information[:, across, row] = edges[:, column]
    return PoseGraphFile(
        ids=np.array(list(rows.index), np.int64),
        poses=poses[:, 1:4],
        i=ends[:, 0],
        j=ends[:, 1],
        measurement=edges[:, 2:_FIRST_ENTRY],
        information=information,
    )


def _ends(path: Path, rows: _Rows) -> Indices:
    """The poses that each edge connects, (m, 2) indices. Raises UsageError where one is missing."""
    ends = []
    for edge, number in zip(rows.edges, rows.edge_lines, strict=True):
        first = int(edge[0])
        second = int(edge[1])
        line = f"{first} {second}"
        for end in (first, second):
            if end not in rows.index:
                raise wrong_line(
                    path, number, line, f"an edge between poses of the file, not {end}"
                )
        if first == second:
            raise wrong_line(path, number, line, "an edge between two poses")
        ends.append((rows.index[first], rows.index[second]))
    return np.array(ends, np.int64)


def read_true_positions(path: Path) -> Floats:
    """True poses, a line each: x, y and heading, with an index before them or not; (n, 2)
    positions.

    Raises UsageError naming the line where something else stands.
    """
    rows: list[list[float]] = []
    for number, line in numbered_lines(path):
        words = line.split()
        if words:
            rows.append(_true_position(path, number, line, words))
    if not rows:
        raise UsageError(f"{path} has no poses")
    return np.array(rows)


def _true_position(path: Path, number: int, line: str, words: list[str]) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise wrong_line(path, number, line, _TRUE_POSE) from None
    if len(values) not in {3, 4} or not np.isfinite(values).all():
        raise wrong_line(path, number, line, _TRUE_POSE)

    x_m, y_m, _heading_rad = values[-3:]
    return [x_m, y_m]
