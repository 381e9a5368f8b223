"""Pose graphs that others recorded, as g2o and TORO write them: poses along a path in the plane,
and what was measured between them.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cogmap.data.text import PACKED, Line, numbered_lines
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import integrate, relative, wrap_angle

# The smallest eigenvalue of an information matrix whose diagonal is scaled to 1: rounding in a
# file of seven digits stays far above.
MIN_EIGENVALUE = 1e-9
GIVE = "a pose graph in the plane as g2o or TORO write it"
POSE = "an id, x, y and heading: 4 numbers with decimal points"
EDGE = (
    "two ids, dx, dy, dheading and 6 entries of an information matrix: 11 numbers with decimal "
    "points"
)
TRUE_POSE = "x, y and heading, with an index before them or not"
log = logging.getLogger("cogmap")


class Format(NamedTuple):
    """How a program writes poses in the plane.

    `information` is where in the matrix the six numbers of an edge stand. Lines that begin with
    one of `skipped` do not change the graph.
    """

    pose: tuple[str, ...]
    edge: tuple[str, ...]
    information: tuple[tuple[int, int], ...]
    skipped: tuple[str, ...]


G2O = Format(
    pose=("VERTEX_SE2",),
    edge=("EDGE_SE2",),
    information=((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)),
    skipped=("PARAMS_",),
)
TORO = Format(
    pose=("VERTEX2", "VERTEX"),
    edge=("EDGE2", "EDGE"),
    information=((0, 0), (0, 1), (1, 1), (2, 2), (0, 2), (1, 2)),
    skipped=("EQUIV",),
)
FORMATS = {".g2o": G2O, ".graph": TORO, ".toro": TORO}


@dataclass(frozen=True)
class PoseGraphFile:
    """`poses` (n, 3) along the path, called `ids` in the file; edge k measures pose `j[k]` as seen
    from pose `i[k]`, both indices. There is an edge from each pose to the next.

    `measurement` (m, 3) is metres, metres, radians; `information` (m, 3, 3) the inverse of its
    covariance, positive definite.
    """

    ids: tuple[int, ...]
    poses: Floats
    i: Indices
    j: Indices
    measurement: Floats
    information: Floats


class _Edge(NamedTuple):
    line: Line
    first: int
    second: int
    values: list[float]


def read(path: Path) -> PoseGraphFile:
    """Read a pose graph, whose format is known by its name.

    Without any pose, the path begins at 0 and follows the edges from each id to the next. In a
    TORO file that names the observed pose first, which some do, the two are exchanged: it is told
    from the poses. Raises UsageError naming file, line and remedy.
    """
    suffixes = [suffix for suffix in path.suffixes[-2:] if suffix not in PACKED]
    if not suffixes or suffixes[-1] not in FORMATS:
        raise UsageError(f"{path} is none of {', '.join(FORMATS)}, plain or packed: give {GIVE}")
    form = FORMATS[suffixes[-1]]

    poses, edges = _poses_and_edges(path, form)
    if not edges:
        raise UsageError(
            f"{path} has {len(poses)} poses and 0 edges: give a graph with what was measured"
        )

    ends = {end for edge in edges for end in (edge.first, edge.second)}
    ids = tuple(poses) or tuple(sorted(ends))
    index = {name: number for number, name in enumerate(ids)}
    for edge in edges:
        for end in (edge.first, edge.second):
            if end not in index:
                remedy = "add it or, for a path that starts from odometry, remove all poses"
                raise edge.line.wrong(f"an edge between poses of the file, not {end}", remedy)
        if edge.first == edge.second:
            raise edge.line.wrong("an edge between two poses", "remove it")

    i = np.array([index[edge.first] for edge in edges])
    j = np.array([index[edge.second] for edge in edges])
    values = np.array([edge.values for edge in edges])
    measurement = values[:, :3]
    information = _information(edges, values[:, 3:], form)

    if form is TORO and poses:
        known = np.array(list(poses.values()))
        if _misfit_m(known[j], known[i], measurement) < _misfit_m(known[i], known[j], measurement):
            i, j = j, i

    is_backward = i == j + 1
    measurement[is_backward], information[is_backward] = _reversed(
        measurement[is_backward], information[is_backward]
    )
    i, j = np.where(is_backward, j, i), np.where(is_backward, i, j)

    # The path follows the first edge from each pose to the next.
    steps = np.flatnonzero(j == i + 1)
    origins, first = np.unique(i[steps], return_index=True)
    for gap in np.setdiff1d(np.arange(len(ids) - 1), origins):
        raise UsageError(
            f"{path}: no edge leads from pose {ids[gap]} to the next, pose {ids[gap + 1]}: "
            "add one, or remove the poses on one side"
        )

    if poses:
        placed = np.array(list(poses.values()))
    else:
        placed = integrate(np.zeros(3), measurement[steps[first]])
        placed[:, 2] = wrap_angle(placed[:, 2])
    return PoseGraphFile(ids, placed, i, j, measurement, information)


def _poses_and_edges(path: Path, form: Format) -> tuple[dict[int, list[float]], list[_Edge]]:
    """Read the poses of a file by their ids, and its edges."""
    poses: dict[int, list[float]] = {}
    edges: list[_Edge] = []
    fixed: dict[int, Line] = {}
    skipped: set[str] = set()

    for line in numbered_lines(path, GIVE):
        content, _, _ = line.text.partition("#")
        word, *words = content.split() or [""]
        if word in form.pose:
            (pose,), values = _numbers(line, words, 1, 3, POSE)
            if pose in poses:
                raise line.wrong("a pose whose id has not been there before", "remove one of them")
            poses[pose] = values
        elif word in form.edge:
            (first, second), values = _numbers(line, words, 2, 9, EDGE)
            edges.append(_Edge(line, first, second, values))
        elif word == "FIX":
            names, _ = _numbers(line, words, len(words), 0, "the id of a pose")
            fixed |= dict.fromkeys(names, line)
        elif word.startswith(form.skipped):
            skipped.add(word)
        elif word:
            known = " or ".join((*form.pose, *form.edge))
            raise line.wrong(
                f"a line that begins with {known}",
                f"only poses in the plane and edges between them are read, remove lines of {word}",
            )

    # One pose that is fixed only determines where the whole graph lies; two are a measurement.
    for pose, line in list(fixed.items())[1:]:
        raise line.wrong(f"one fixed pose in all, not {pose} too", "put an edge in its place")
    for word in sorted(skipped):
        log.warning("%s: lines of %s are not read: the graph is as it is without them", path, word)
    return poses, edges


def _numbers(
    line: Line, words: Sequence[str], ids: int, count: int, expected: str
) -> tuple[list[int], list[float]]:
    """Read ids, which are whole and may have 64 bits, and `count` finite numbers."""
    try:
        names = [int(word) for word in words[:ids]]
        values = [float(word) for word in words[ids:]]
    except ValueError:
        raise line.wrong(expected, "mend the line") from None

    if not names or len(values) != count or not all(map(math.isfinite, values)):
        raise line.wrong(expected, "mend the line")
    return names, values


def _information(edges: Sequence[_Edge], entries: Floats, form: Format) -> Floats:
    """Fill (m, 3, 3) matrices with (m, 6) entries. Raises UsageError for one that is no inverse of
    a covariance.
    """
    information = np.empty((len(edges), 3, 3))
    for column, (row, across) in enumerate(form.information):
        information[:, row, across] = entries[:, column]
        information[:, across, row] = entries[:, column]

    diagonal = np.diagonal(information, axis1=1, axis2=2)
    is_wrong = np.any(diagonal <= 0, axis=1)
    scale = 1 / np.sqrt(np.where(is_wrong[:, None], 1.0, diagonal))
    eigenvalues = np.linalg.eigvalsh(information * scale[:, :, None] * scale[:, None, :])
    is_wrong |= eigenvalues[:, 0] < MIN_EIGENVALUE
    for wrong in np.flatnonzero(is_wrong).tolist():
        raise edges[wrong].line.wrong(
            "a positive definite information matrix",
            "give x, y and heading each an information above 0, or remove the edge",
        )
    return information


def _misfit_m(origins: Floats, ends: Floats, measurement: Floats) -> float:
    """Return the median distance between measured positions and those of (m, 3) poses."""
    offsets = relative(origins, ends) - measurement
    return float(np.median(np.hypot(offsets[:, 0], offsets[:, 1])))


def _reversed(measurement: Floats, information: Floats) -> tuple[Floats, Floats]:
    """Return k measurements as seen from their other ends, and their information there, by the
    derivative of the one by the other.
    """
    back = relative(measurement, np.zeros(3))
    derivative = np.zeros((len(back), 3, 3))
    cos, sin = np.cos(back[:, 2]), np.sin(back[:, 2])
    derivative[:, 0, 0] = derivative[:, 1, 1] = -cos
    derivative[:, 0, 1] = sin
    derivative[:, 1, 0] = -sin
    derivative[:, 0, 2] = back[:, 1]
    derivative[:, 1, 2] = -back[:, 0]
    derivative[:, 2, 2] = -1.0

    inverse = np.linalg.inv(derivative)
    return back, inverse.transpose(0, 2, 1) @ information @ inverse


def read_true_positions(path: Path) -> Floats:
    """Read true poses, a line each: x, y and heading, with an index before them or not; (n, 2)
    positions.

    Raises UsageError naming the line of something else.
    """
    rows: list[list[float]] = []
    for line in numbered_lines(path, "true poses, a line each"):
        words = line.text.split()
        if not words:
            continue
        try:
            values = [float(word) for word in words]
        except ValueError:
            raise line.wrong(TRUE_POSE) from None
        if len(values) not in {3, 4} or not all(map(math.isfinite, values)):
            raise line.wrong(TRUE_POSE)
        rows.append(values[-3:-1])

    if not rows:
        raise UsageError(f"{path} has no poses: give true poses, a line each")
    return np.array(rows)
