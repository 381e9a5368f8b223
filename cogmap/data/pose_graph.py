"""Pose graphs that others recorded: poses in the plane, and what was measured between them."""

from __future__ import annotations

import lzma
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cogmap.data.lines import wrong_line
from cogmap.errors import UsageError

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Order = tuple[tuple[int, int], ...]
POSE = "pose"
EDGE = "edge"
EXPECTED = {
    POSE: "an id, x, y and heading: 4 numbers",
    EDGE: "two ids, dx, dy, dheading and 6 entries of an information matrix: 11 numbers",
}
NUMBERS = {POSE: (1, 4), EDGE: (2, 11)}


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
    """A pose graph of lines that begin with one of `kinds`, which says whether each is a POSE or an
    EDGE.

    `order` is where in the matrix the six numbers of information stand. Raises UsageError naming
    file and line.
    """
    rows: dict[str, list[list[float]]] = {POSE: [], EDGE: []}
    index: dict[int, int] = {}
    for number, line in numbered_lines(path):
        word, *rest = line.split() or ["#"]
        if word.startswith("#"):
            continue
        if word not in kinds:
            raise wrong_line(path, number, line, f"a line that begins with {' or '.join(kinds)}")
        kind = kinds[word]
        values = _numbers(path, number, line, rest, kind)
        if kind == POSE and index.setdefault(int(values[0]), len(index)) != len(rows[POSE]):
            raise wrong_line(path, number, line, "a pose whose id has not been there before")
        rows[kind].append([*values, number])
    if not rows[POSE] or not rows[EDGE]:
        raise UsageError(
            f"{path} has {len(rows[POSE])} poses and {len(rows[EDGE])} edges: a graph needs both"
        )
    return _graph(path, index, np.array(rows[POSE]), np.array(rows[EDGE]), order)


def _numbers(path: Path, number: int, line: str, words: Iterable[str], kind: str) -> list[float]:
    ids, expected = NUMBERS[kind]
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise wrong_line(path, number, line, EXPECTED[kind]) from None
    whole = all(value.is_integer() for value in values[:ids])
    if len(values) != expected or not whole or not np.isfinite(values).all():
        raise wrong_line(path, number, line, EXPECTED[kind])
    return values


def _graph(
    path: Path, index: Mapping[int, int], poses: Floats, edges: Floats, order: Order
) -> PoseGraphFile:
    ends = edges[:, :2].astype(np.int64)
    for (first, second), number in zip(
        ends.tolist(), edges[:, -1].astype(int).tolist(), strict=True
    ):
        for end in (first, second):
            if end not in index:
                raise wrong_line(
                    path,
                    number,
                    f"{first} {second}",
                    f"an edge between poses of the file, not {end}",
                )
        if first == second:
            raise wrong_line(path, number, f"{first} {second}", "an edge between two poses")
    information = np.empty((len(edges), 3, 3))
    for column, (row, across) in enumerate(order, 5):
        information[:, row, across] = information[:, across, row] = edges[:, column]
    where = np.array([[index[first], index[second]] for first, second in ends.tolist()])
    ids = np.array(list(index), np.int64)
    return PoseGraphFile(ids, poses[:, 1:4], where[:, 0], where[:, 1], edges[:, 2:5], information)


def read_true_positions(path: Path) -> Floats:
    """True poses, a line each: x, y and heading, with an index before them or not; (n, 2)
    positions.

    Raises UsageError naming the line where something else stands.
    """
    rows: list[list[float]] = []
    for number, line in numbered_lines(path):
        words = line.split()
        if not words:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) not in {3, 4} or not np.isfinite(values).all():
            raise wrong_line(
                path, number, line, "x, y and heading, with an index before them or not"
            )
        rows.append(values[-3:-1])
    if not rows:
        raise UsageError(f"{path} has no poses")
    return np.array(rows)
