"""The apply-correction codelet: it applies a correction of the path to the map (paper §5.6).

Each object and each place node moves with the place of the path that is nearest to it, and so does
the frame of each sub-map, whose place nodes stay as they are in it. What was written since the
correction was computed is kept: places that the path has gained move with its last.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import mean_pose, move_with, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext, NoSettings
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import DropNode, Link, Operation, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    POSE_COLUMNS,
    ROOT_MAP,
    Correction,
    CorrectionColumn,
    LinkKind,
    Map,
    Object,
    Observations,
    PathSegment,
    Self,
    is_coarse_map,
    nearest_place,
)
from cogmap.services.codelets.correction.place_columns import MOVED_COLUMNS, move_places
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import POSE, STAMP, with_rows

OLD = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_HEADING_RAD + 1)
NEW = slice(CorrectionColumn.NEW_X_M, CorrectionColumn.NEW_HEADING_RAD + 1)
OLD_POSITION = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_Y_M + 1)
BESIDE_M = 10.0


def due(context: CycleContext, graph: Graph, config: NoSettings) -> list[Task]:
    """One task where a correction waits to be applied."""
    if CORRECTION_ID not in graph.nodes:
        return []

    task = context.task(CODELET.name, about=[CORRECTION_ID])
    return [task]


def run(task: Task, graph: Graph, config: NoSettings) -> Answer:
    """Move everything on the map as the correction states, and forget the correction."""
    correction = graph.get(Correction, CORRECTION_ID)
    if correction is None:
        raise MessageError(f"task {task.task_id}: the correction was applied before")

    rows = correction.rows.numpy()
    if _is_outdated(rows, graph):
        return Answer([DropNode(id=CORRECTION_ID)])
    return Answer([DropNode(id=CORRECTION_ID), *moved(graph, rows)])


def moved(graph: Graph, rows: Floats) -> list[Operation]:
    """Everything on the root map, moved as (n, 7) rows of a correction state."""
    path = _corrected_path(graph, rows)
    operations = _move_path(graph, path)
    if graph.agent is not None:
        operations += _move_self(graph, graph.agent, rows[-1:])
    operations += _move_objects(graph, rows, path)
    operations += _move_maps(graph, rows)
    operations += move_places(graph, rows[:, OLD], rows[:, NEW])
    return operations


CODELET = Codelet(
    name="apply_correction",
    phase=Phase.CORRECTION,
    due=due,
    run=run,
    reads=frozenset({Correction, PathSegment, Observations, Self, Object, Map, *MOVED_COLUMNS}),
    writes=frozenset({Correction, PathSegment, Self, Object, Map, LinkKind.AT, *MOVED_COLUMNS}),
)


def _is_outdated(rows: Floats, graph: Graph) -> bool:
    """Whether the path has moved as a whole since the correction was computed: no other correction
    is under way meanwhile, so nothing else moves its first place.
    """
    path = rows_of(graph.of_kind(PathSegment))
    if not len(path) or path[0, STAMP] != rows[0, STAMP]:
        return False
    return not np.array_equal(path[0, POSE], rows[0, OLD])


def _corrected_path(graph: Graph, rows: Floats) -> Floats:
    """The rows of the whole path, with its places corrected."""
    path = rows_of(graph.of_kind(PathSegment))
    stamps_s = path[:, STAMP]

    following = np.searchsorted(rows[:, STAMP], stamps_s)
    last = len(rows) - 1
    corrections = rows[following.clip(0, last)]

    path[:, POSE] = _moved_poses(path[:, POSE], corrections)
    return path


def _move_path(graph: Graph, path: Floats) -> list[Operation]:
    """The segments of the path of which places move, `path` being all its corrected rows."""
    operations: list[Operation] = []
    start = 0
    for segment in graph.path:
        before = segment.rows.numpy()
        after = path[start : start + len(before)]
        start += len(before)
        if not np.array_equal(before, after):
            operations.append(with_rows(segment, after))

    return operations


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
    samples = _moved_samples(agent.samples.numpy(), last)
    x_m, y_m = samples[:, :2].mean(axis=0).tolist()
    heading_rad = mean_pose(samples)[2]

    after = msgspec.structs.replace(
        agent,
        x_m=x_m,
        y_m=y_m,
        heading_rad=float(heading_rad),
        samples=Matrix.of(samples),
    )
    return [after, _place_link(after, graph)]


def _moved_samples(samples: Floats, last: Floats) -> Floats:
    """The samples of the self node, whose poses move as the row `last` of the correction does."""
    poses = samples[:, :POSE_COLUMNS]
    gains = samples[:, POSE_COLUMNS:]

    moved = _moved_poses(poses, last)
    return np.column_stack([moved, gains])


def _move_objects(graph: Graph, rows: Floats, path: Floats) -> list[Operation]:
    """The objects move, but for those that were surveyed. `path` is the corrected one."""
    landmarks_m = _landmarks_m(graph, path)

    operations = []
    for node in graph.of_kind(Object):
        if not node.surveyed:
            seen_m = landmarks_m.get(node.label)
            operations += _move_object(graph, node, rows, seen_m)

    return operations


def _move_maps(graph: Graph, rows: Floats) -> list[Operation]:
    """The frames of the root map's sub-maps move; those of their own sub-maps are in theirs."""
    operations: list[Operation] = []
    for node in graph.of_kind(Map):
        if node.parent != ROOT_MAP or is_coarse_map(node.id):
            continue

        pose = np.array([[node.x_m, node.y_m, node.heading_rad]])
        away_m = np.hypot(*(rows[:, OLD_POSITION] - pose[:, :2]).T)
        nearest = away_m.argmin()
        moved = _moved_poses(pose, rows[[nearest]])
        if np.array_equal(moved, pose):
            continue

        ((x_m, y_m, heading_rad),) = moved.tolist()
        after = msgspec.structs.replace(node, x_m=x_m, y_m=y_m, heading_rad=heading_rad)
        operations.append(after)

    return operations


def _landmarks_m(graph: Graph, path: Floats) -> dict[str, Floats]:
    """Where landmarks are seen from the path, (2,) each, by label."""
    stamps_s = path[:, STAMP]
    poses = path[:, POSE]

    seen = Sightings.of(graph.of_kind(Observations), stamps_s)
    positions_m = seen.landmarks_m(poses)
    return dict(zip(seen.labels, positions_m, strict=True))


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

    after = _placed(node, moved_m)
    return [after, _place_link(after, graph)]


def _placed(node: Object, positions_m: Floats) -> Object:
    """The object with (n, 2) samples of its position."""
    mean_m = positions_m.mean(axis=0)
    x_m, y_m = mean_m.tolist()

    offsets_m = None
    if node.offsets_m is not None:
        offsets_m = Matrix.of(positions_m - mean_m, "<f2")

    return msgspec.structs.replace(node, x_m=x_m, y_m=y_m, offsets_m=offsets_m)


def _row_of(node: Object, mean_m: Floats, rows: Floats) -> Floats:
    """(1, 7): the row of the correction that an object moves with."""
    known = _rows_while_known(node, rows)
    offset_m = known[:, OLD_POSITION] - mean_m
    away_m = np.hypot(*offset_m.T)

    nearest = _first_pass(away_m)
    return known[[nearest]]


def _rows_while_known(node: Object, rows: Floats) -> Floats:
    """(k, 7): the rows of the places from which an object came to be known, at least one."""
    since_s = node.created_ns * 1e-9
    until_s = node.last_seen_ns * 1e-9

    stamps_s = rows[:, STAMP]
    is_known = (stamps_s >= since_s) & (stamps_s <= until_s)
    if is_known.any():
        return rows[is_known]

    # One seen since the correction was computed moves with the path's last place.
    away_s = np.abs(stamps_s - since_s)
    nearest = away_s.argmin()
    return rows[[nearest]]


def _first_pass(away_m: Floats) -> int:
    """The nearest of the places, by (n,) distances along the path, where it first passes by.

    Not the nearest of all: where a loop has drifted, its end may lie nearer than the beginning that
    an object was seen from.
    """
    nearest_m = away_m.min()
    near_m = max(2 * nearest_m, nearest_m + BESIDE_M)
    passing = np.flatnonzero(away_m <= near_m)

    first = _first_run(passing)
    index = away_m[first].argmin()
    return int(first[index])


def _first_run(numbers: Indices) -> Indices:
    """The successive numbers that ascending `numbers` begin with."""
    gaps = np.flatnonzero(np.diff(numbers) > 1)
    if not len(gaps):
        return numbers

    end = gaps[0] + 1
    return numbers[:end]


def _place_link(node: Self | Object, graph: Graph) -> Link:
    cell_m = graph.cell_m(node.map)
    place = nearest_place(node.x_m, node.y_m, cell_m, node.map)
    return Link(source=node.id, target=place, kind=LinkKind.AT)
