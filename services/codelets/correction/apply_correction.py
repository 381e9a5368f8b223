"""The apply-correction codelet: it applies a correction of the path to the map (paper §5.6).

Each object and each place node moves with the place of the path that is nearest to it, and so does
the frame of each sub-map, whose place nodes stay as they are in it. What was written since the
correction was computed is kept: places that the path has gained move with its last.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, move_with, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
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
    object_id,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.correction.place_columns import MOVED_COLUMNS, move_places
from cogmap.services.codelets.localization.sampling import generator
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import POSE, STAMP, with_rows
from cogmap.services.codelets.mapping.ranges import Ranges

OLD = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_HEADING_RAD + 1)
NEW = slice(CorrectionColumn.NEW_X_M, CorrectionColumn.NEW_HEADING_RAD + 1)
OLD_POSITION = slice(CorrectionColumn.OLD_X_M, CorrectionColumn.OLD_Y_M + 1)
# Places of the path so much farther than the nearest are still of the same passing by.
BESIDE_M = 10.0


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task if a correction waits to be applied."""
    if CORRECTION_ID not in graph.nodes:
        return []
    return [context.task(CODELET.name, about=[CORRECTION_ID])]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Move everything on the map as the correction states, and forget the correction."""
    correction = graph.get(Correction, CORRECTION_ID)
    if correction is None:
        raise MessageError(f"task {task.task_id}: the correction was applied before")

    # No other correction is under way meanwhile: if the first place of the path has moved, the path
    # has moved as a whole since this one was computed, and it is outdated.
    rows = correction.rows.numpy()
    path = rows_of(graph.of_kind(PathSegment))
    has_begun = len(path) > 0 and path[0, STAMP] == rows[0, STAMP]
    if has_begun and not np.array_equal(path[0, POSE], rows[0, OLD]):
        return Answer([DropNode(id=CORRECTION_ID)])
    by_nearest = config.correct == "eq9"
    return Answer([DropNode(id=CORRECTION_ID), *moved(graph, rows, by_nearest=by_nearest)])


def moved(graph: Graph, rows: Floats, *, by_nearest: bool = False) -> list[Operation]:
    """Move everything on the root map as (n, 7) rows of a correction state: objects, as they were
    observed, or each `by_nearest` place of the path (paper §5.6).
    """
    # Each place of the path moves with the first row that is not before it.
    path = rows_of(graph.of_kind(PathSegment))
    following = np.searchsorted(rows[:, STAMP], path[:, STAMP]).clip(0, len(rows) - 1)
    path[:, POSE] = _moved_poses(path[:, POSE], rows[following])

    operations: list[Operation] = []
    start = 0
    for segment in graph.path:
        before = segment.rows.numpy()
        after = path[start : start + len(before)]
        start += len(before)
        if not np.array_equal(before, after):
            operations.append(with_rows(segment, after))

    # The agent moves with the last place of its path.
    agent = graph.agent
    if agent is not None:
        samples = agent.samples.numpy()
        poses = _moved_poses(samples[:, :POSE_COLUMNS], rows[-1:])
        samples = np.column_stack([poses, samples[:, POSE_COLUMNS:]])
        x_m, y_m = samples[:, :2].mean(axis=0).tolist()
        heading_rad = float(mean_pose(samples)[2])
        moved_agent = msgspec.structs.replace(
            agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad, samples=Matrix.of(samples)
        )
        operations += [moved_agent, _place_link(moved_agent, graph)]

    operations += _shift_objects(graph, rows) if by_nearest else _move_objects(graph, rows, path)
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
    config=Config,
    section=SECTION,
)


def _moved_poses(poses: Floats, rows: Floats) -> Floats:
    """Move (n, 3) poses, each as a row of the correction is moved."""
    old = rows[:, OLD]
    new = rows[:, NEW]
    positions_m = move_with(poses[:, :2], old, new)

    turned_rad = new[:, 2] - old[:, 2]
    headings_rad = wrap_angle(poses[:, 2] + turned_rad)

    return np.column_stack([positions_m, headings_rad])


def _move_objects(graph: Graph, rows: Floats, path: Floats) -> list[Operation]:
    """Move the objects, except those that were surveyed, to where they are seen from the corrected
    `path`. If they were not observed along it, move them with the place nearest to them, of those
    from which they came to be known.
    """
    seen = Sightings.of(graph.of_kind(Observations), path[:, STAMP])
    landmarks_m = dict(zip(seen.labels, seen.landmarks_m(path[:, POSE]), strict=True))
    heard_m = _heard(graph, path)

    operations: list[Operation] = []
    for node in graph.of_kind(Object):
        if node.surveyed:
            continue

        positions_m = node.positions_m()
        mean_m = positions_m.mean(axis=0)
        if node.label in landmarks_m:
            moved_m = positions_m + landmarks_m[node.label] - mean_m
        elif node.label in heard_m:
            moved_m = heard_m[node.label]
        else:
            row = _row_of(node, mean_m, rows)
            moved_m = move_with(positions_m, row[:, OLD], row[:, NEW])

        operations += _placed(node, positions_m, moved_m, graph)

    return operations


def _shift_objects(graph: Graph, rows: Floats) -> list[Operation]:
    """Move the objects, except those that were surveyed, each with the place of the path that is
    nearest to it, however it was observed.
    """
    operations: list[Operation] = []
    for node in graph.of_kind(Object):
        if node.surveyed:
            continue

        positions_m = node.positions_m()
        away_m = np.hypot(*(rows[:, OLD_POSITION] - positions_m.mean(axis=0)).T)
        row = rows[[away_m.argmin()]]
        moved_m = move_with(positions_m, row[:, OLD], row[:, NEW])
        operations += _placed(node, positions_m, moved_m, graph)

    return operations


def _placed(node: Object, before_m: Floats, after_m: Floats, graph: Graph) -> list[Operation]:
    """Place an object at (n, 2) samples `after_m` and link it to its place, if they are not as
    `before_m`.
    """
    if np.array_equal(after_m, before_m):
        return []

    mean_m = after_m.mean(axis=0)
    x_m, y_m = mean_m.tolist()
    samples = None if node.offsets_m is None else Matrix.of(after_m - mean_m, "<f2")
    after = msgspec.structs.replace(node, x_m=x_m, y_m=y_m, offsets_m=samples)
    return [after, _place_link(after, graph)]


def _heard(graph: Graph, path: Floats) -> dict[str, Floats]:
    """Draw (n, 2) positions for each landmark that was observed by its range alone, along the
    corrected `path`: how a ring that it stood on moves, its samples do not say.
    """
    ranges = Ranges.of(graph.of_kind(Observations), path[:, STAMP])
    if not ranges.labels:
        return {}

    found = ranges.landmarks(path[:, POSE])
    rng = generator(f"{path[-1, STAMP]}/{len(path)}")
    drawn = {}
    for label, mean_m, covariance_m2 in zip(
        ranges.labels, found.positions_m, found.covariance_m2, strict=True
    ):
        node = graph.get(Object, object_id(label))
        if node is not None:
            count = len(node.positions_m())
            drawn[label] = rng.multivariate_normal(mean_m, covariance_m2, count)

    return drawn


def _move_maps(graph: Graph, rows: Floats) -> list[Operation]:
    """Move the frames of the root map's sub-maps; sub-maps in these move along."""
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


def _row_of(node: Object, mean_m: Floats, rows: Floats) -> Floats:
    """Find the row of the correction that an object moves with, (1, 7)."""
    since_s = node.created_ns * 1e-9
    stamps_s = rows[:, STAMP]
    known = rows[(stamps_s >= since_s) & (stamps_s <= node.last_seen_ns * 1e-9)]
    if not len(known):
        # One seen since the correction was computed moves with the path's last place.
        nearest = np.abs(stamps_s - since_s).argmin()
        return rows[[nearest]]

    # The nearest of the places where the path first passes by, not of all: if a loop has drifted,
    # its end may lie nearer than the beginning that the object was seen from.
    away_m = np.hypot(*(known[:, OLD_POSITION] - mean_m).T)
    nearest_m = away_m.min()
    passing = np.flatnonzero(away_m <= max(2 * nearest_m, nearest_m + BESIDE_M))
    gaps = np.flatnonzero(np.diff(passing) > 1)
    first = passing[: gaps[0] + 1] if len(gaps) else passing
    return known[[first[away_m[first].argmin()]]]


def _place_link(node: Self | Object, graph: Graph) -> Link:
    cell_m = graph.cell_m(node.map)
    place = nearest_place(node.x_m, node.y_m, cell_m, node.map)
    return Link(source=node.id, target=place, kind=LinkKind.AT)
