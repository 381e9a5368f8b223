"""The apply-correction codelet: it applies a correction of the path to the map (paper §5.6).

Each object and each road node moves with the place of the path that is nearest to it. What was
written since the correction was computed is kept: places that the path has gained move with its
last.
"""

from __future__ import annotations

import msgspec
import numpy as np
from scipy.spatial import cKDTree

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import mean_pose, move_with, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.array import Array, Matrix
from schemas.codelets import Task
from schemas.graph import Cells, DropNode, Link, Operation, Phase
from schemas.nodes import (
    CORRECTION_ID,
    POSE_COLUMNS,
    ROOT_MAP,
    Correction,
    CorrectionColumn,
    LinkKind,
    Object,
    Observations,
    PathSegment,
    PlaceColumn,
    Self,
    nearest_place,
)
from services.codelets.config import SECTION, Config
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import POSE, STAMP, rows_of, segments

OLD = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_HEADING_RAD + 1)
NEW = slice(CorrectionColumn.NEW_X_M, CorrectionColumn.NEW_HEADING_RAD + 1)
OLD_POSITION = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_Y_M + 1)
AROUND = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
MAX_CELLS = 2**16
BESIDE_M = 10.0


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where a correction waits to be applied."""
    if CORRECTION_ID not in graph.nodes:
        return []

    task = context.task(CODELET.name, about=[CORRECTION_ID])
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Move everything on the map as the correction states, and forget the correction."""
    correction = graph.get(Correction, CORRECTION_ID)
    if correction is None:
        raise MessageError(f"task {task.task_id}: the correction was applied before")

    rows = correction.rows.numpy()
    path = _corrected_path(graph, rows)
    operations: list[Operation] = [DropNode(id=CORRECTION_ID), *segments(path)]
    if graph.agent is not None:
        operations += _move_self(graph, graph.agent, rows[-1:])

    seen = Sightings.of(graph.of_kind(Observations), path[:, STAMP])
    positions_m = seen.landmarks_m(path[:, POSE])
    landmarks_m = dict(zip(seen.labels, positions_m, strict=True))
    for node in graph.of_kind(Object):
        if not node.surveyed:
            operations += _move_object(graph, node, rows, landmarks_m.get(node.label))

    operations += _move_road(graph, rows)
    return Answer(operations)


CODELET = Codelet(
    name="apply_correction",
    phase=Phase.CORRECTION,
    due=due,
    run=run,
    reads=frozenset({Correction, PathSegment, Observations, Self, Object, PlaceColumn.ROAD}),
    writes=frozenset({Correction, PathSegment, Self, Object, LinkKind.AT, PlaceColumn.ROAD}),
    config=Config,
    section=SECTION,
)


def _corrected_path(graph: Graph, rows: Floats) -> Floats:
    """The rows of the whole path, with its places corrected."""
    path = rows_of(graph.of_kind(PathSegment))

    following = np.searchsorted(rows[:, STAMP], path[:, STAMP])
    at = following.clip(0, len(rows) - 1)
    path[:, POSE] = _moved_poses(path[:, POSE], rows[at])
    return path


def _moved_poses(poses: Floats, rows: Floats) -> Floats:
    """(n, 3) poses, each moved as a row of the correction is."""
    old = rows[:, OLD]
    new = rows[:, NEW]
    positions_m = move_with(poses[:, :2], old, new)

    turned_rad = new[:, 2] - old[:, 2]
    headings_rad = wrap_angle(poses[:, 2] + turned_rad)
    return np.column_stack([positions_m, headings_rad])


def _move_self(graph: Graph, agent: Self, last: Floats) -> list[Operation]:
    """The agent moves with the last place of its path."""
    samples = agent.samples.numpy()
    poses = _moved_poses(samples[:, :POSE_COLUMNS], last)
    moved = np.column_stack([poses, samples[:, POSE_COLUMNS:]])

    x_m, y_m = moved[:, :2].mean(axis=0).tolist()
    after = msgspec.structs.replace(
        agent,
        x_m=x_m,
        y_m=y_m,
        heading_rad=float(mean_pose(moved)[2]),
        samples=Matrix.of(moved),
    )
    return [after, _place_link(after, graph)]


def _move_object(
    graph: Graph, node: Object, rows: Floats, seen_m: Floats | None
) -> list[Operation]:
    """An object moves to where it is seen from the corrected path: `seen_m` (2,).

    One that was not observed along the path moves with the place nearest to it, of those from which
    it came to be known. One that does not move is not written.
    """
    positions_m = node.positions_m()
    mean_m = positions_m.mean(axis=0)

    if seen_m is not None:
        moved_m = positions_m + seen_m - mean_m
    else:
        row = _row_of(node, mean_m, rows)
        moved_m = move_with(positions_m, row[:, OLD], row[:, NEW])

    if np.array_equal(moved_m, positions_m):
        return []

    mean_m = moved_m.mean(axis=0)
    offsets_m = None
    if node.offsets_m is not None:
        offsets_m = Matrix.of(moved_m - mean_m, "<f2")

    after = msgspec.structs.replace(
        node,
        x_m=float(mean_m[0]),
        y_m=float(mean_m[1]),
        offsets_m=offsets_m,
    )
    return [after, _place_link(after, graph)]


def _row_of(node: Object, mean_m: Floats, rows: Floats) -> Floats:
    """(1, 7): the row of the correction that an object moves with."""
    since_s = node.created_ns * 1e-9
    until_s = node.last_seen_ns * 1e-9
    stamps_s = rows[:, STAMP]
    is_known = (stamps_s >= since_s) & (stamps_s <= until_s)
    known = np.flatnonzero(is_known)
    if not len(known):
        # One seen since the correction was computed moves with the path's last place.
        away_s = np.abs(stamps_s - since_s)
        known = np.array([int(away_s.argmin())])

    near = rows[known]
    offset_m = near[:, OLD_POSITION] - mean_m
    away_m = np.hypot(*offset_m.T)
    nearest = _first_pass(away_m)
    return near[[nearest]]


def _first_pass(away_m: Floats) -> int:
    """The nearest of the places, by (n,) distances along the path, where it first passes by.

    Not the nearest of all: where a loop has drifted, its end may lie nearer than the beginning that
    an object was seen from.
    """
    nearest_m = away_m.min()
    near_m = max(2 * nearest_m, nearest_m + BESIDE_M)
    passing = np.flatnonzero(away_m <= near_m)

    gaps = np.flatnonzero(np.diff(passing) > 1)
    first = passing
    if len(gaps):
        first = passing[: gaps[0] + 1]
    index = away_m[first].argmin()
    return int(first[index])


def _place_link(node: Self | Object, graph: Graph) -> Link:
    cell_m = graph.cell_m(node.map)
    place = nearest_place(node.x_m, node.y_m, cell_m, node.map)
    return Link(source=node.id, target=place, kind=LinkKind.AT)


def _move_road(graph: Graph, rows: Floats) -> list[Operation]:
    """Move each road node with the place nearest to it, and fill the gaps that a turn would leave
    between them.
    """
    cells, values = graph.places.written_cells(ROOT_MAP, PlaceColumn.ROAD)
    if not len(cells):
        return []

    cell_m = graph.cell_m()
    old = rows[:, OLD]
    new = rows[:, NEW]
    arrived = _moved_cells(cells, old, new, cell_m)
    neighbours = arrived[:, None, :] + AROUND
    around = np.unique(neighbours.reshape(-1, 2), axis=0)
    origin = _moved_cells(around, new, old, cell_m)

    before = dict(zip(_keys(cells), values.tolist(), strict=True))
    after = dict.fromkeys(before, 0.0)
    for cell, source in zip(_keys(around), _keys(origin), strict=True):
        value = before.get(source, 0.0)
        if value > 0:
            after[cell] = max(after.get(cell, 0.0), value)

    for cell, value in zip(_keys(arrived), values.tolist(), strict=True):
        after[cell] = max(after.get(cell, 0.0), value)

    changed = {}
    for cell, value in after.items():
        if before.get(cell, 0.0) != value:
            changed[cell] = value
    return _cells(changed)


def _keys(cells: Indices) -> list[tuple[int, int]]:
    keys = []
    for i, j in cells.tolist():
        keys.append((i, j))

    return keys


def _cells(values: dict[tuple[int, int], float]) -> list[Operation]:
    """New values of road nodes, at most as many at once as the workspace takes."""
    cells = np.array(list(values), np.int32).reshape(-1, 2)
    roads = np.array(list(values.values()), np.float32)

    parts: list[Operation] = []
    for start in range(0, len(cells), MAX_CELLS):
        some = slice(start, start + MAX_CELLS)
        part = Cells(
            map=ROOT_MAP,
            column=PlaceColumn.ROAD,
            cells=Array.of(cells[some]),
            values=Array.of(roads[some]),
        )
        parts.append(part)

    return parts


def _moved_cells(cells: Indices, old: Floats, new: Floats, cell_m: float) -> Indices:
    """(k, 2) cells, each moved as the pose nearest to it is, from (n, 3) `old` to `new`."""
    points_m = cells.astype(np.float64) * cell_m
    _, nearest = cKDTree(old[:, :2]).query(points_m)

    moved_m = move_with(points_m, old[nearest], new[nearest])
    return np.rint(moved_m / cell_m).astype(np.int64)
