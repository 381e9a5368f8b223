"""The map shift codelet: it carries out a correction of the path on the map as it is now (paper
§5.6).

Each object and each road node moves with the place of the path that is nearest to it. What was
written since the correction was computed is kept: places that the path has gained move with its
last.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import mean_pose, move_with, wrap_angle
from cogmap.graph.graph import TILE_SIDE, nearest_place
from schemas.array import Array
from schemas.base import Scalar
from schemas.cognition import Task
from schemas.graph import Cells, DropNode, Node, Operation
from services.codelets.config import Config
from services.codelets.correction.map_correction import CORRECTION
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import KIND as PATH
from services.codelets.mapping.path import POSE, STAMP, rows_of, segments
from services.codelets.mapping.places import place_link

COLUMNS = 7
OLD = slice(1, 4)
NEW = slice(4, 7)
AROUND = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
AT_ONCE = 4096
BESIDE_M = 10.0


def shift_map(task: Task, config: Config) -> list[Operation]:
    """Everything on the map where the correction puts it, and the correction forgotten."""
    correction = next(node for node in task.nodes if node.kind == CORRECTION)
    if correction.samples is None or correction.samples.shape[1:] != (COLUMNS,):
        raise MessageError(f"a correction whose rows are not {COLUMNS} numbers")
    rows = np.asarray(correction.samples.numpy(), np.float64)
    path = _path(task, rows)
    operations: list[Operation] = [DropNode(id=CORRECTION), *segments(path, _first_number(task))]
    seen = Sightings.of(task.nodes, path[:, STAMP])
    landmarks_m = dict(zip(seen.labels, seen.landmarks_m(path[:, POSE]), strict=True))
    for node in task.nodes:
        if node.kind == "self":
            operations += _self(task, node, rows[-1:])
        elif node.kind == "object":
            operations += _object(
                task, node, rows, landmarks_m.get(str(node.attributes.get("label")))
            )
    return [*operations, *_road(task, rows)]


def _path(task: Task, rows: Floats) -> Floats:
    """The path with its places corrected."""
    path = rows_of(task.nodes)
    at = np.searchsorted(rows[:, STAMP], path[:, STAMP]).clip(0, len(rows) - 1)
    path[:, POSE] = _poses(path[:, POSE], rows[at])
    return path


def _first_number(task: Task) -> int:
    return min(
        (int(node.attributes["number"]) for node in task.nodes if node.kind == PATH), default=0
    )


def _poses(poses: Floats, rows: Floats) -> Floats:
    heading = wrap_angle(poses[:, 2] + rows[:, NEW][:, 2] - rows[:, OLD][:, 2])
    return np.column_stack([move_with(poses[:, :2], rows[:, OLD], rows[:, NEW]), heading])


def _self(task: Task, node: Node, last: Floats) -> list[Operation]:
    """The agent moves with the last place of its path."""
    if node.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    samples = np.asarray(node.samples.numpy(), np.float64)
    moved = np.column_stack([_poses(samples[:, :3], last), samples[:, 3:]])
    mean = mean_pose(moved)
    facts: dict[str, Scalar] = {"heading_rad": float(mean[2])}
    return _placed(task, node, moved, facts)


def _object(task: Task, node: Node, rows: Floats, seen_m: Floats | None) -> list[Operation]:
    """An object moves to where it is seen from the corrected path: `seen_m` (2,).

    One that was not recorded on the way moves with the place nearest to it of those from where it
    came to be known.
    """
    if node.samples is None:
        return []
    samples = np.asarray(node.samples.numpy(), np.float64)
    if seen_m is not None:
        return _placed(task, node, samples + seen_m - samples.mean(axis=0), {})
    since_s, until_s = (int(node.attributes.get(key, 0)) * 1e-9 for key in ("since_ns", "stamp_ns"))
    known = np.flatnonzero((rows[:, STAMP] >= since_s) & (rows[:, STAMP] <= until_s))
    # One seen since the correction was computed goes with the path's last place.
    near = rows[known] if len(known) else rows[[int(np.abs(rows[:, STAMP] - since_s).argmin())]]
    away = np.hypot(*(near[:, OLD][:, :2] - samples[:, :2].mean(axis=0)).T)
    row = near[[_first_pass(away)]]
    return _placed(task, node, move_with(samples, row[:, OLD], row[:, NEW]), {})


def _first_pass(away: Floats) -> int:
    """The nearest of the places, by (n,) distances along the path, where it first passes by.

    Not the nearest of all: where a loop has drifted, its end may lie nearer than the beginning that
    an object is of.
    """
    passing = np.flatnonzero(away <= max(2 * away.min(), away.min() + BESIDE_M))
    gone = np.flatnonzero(np.diff(passing) > 1)
    first = passing[: gone[0] + 1] if len(gone) else passing
    return int(first[away[first].argmin()])


def _placed(task: Task, node: Node, samples: Floats, facts: dict[str, Scalar]) -> list[Operation]:
    """The node with its samples moved, and its link to the place of their mean."""
    x_m, y_m = samples[:, :2].mean(axis=0).tolist()
    cell = nearest_place(x_m, y_m, task.cell_m)
    attributes = node.attributes | {"x_m": x_m, "y_m": y_m, "place": cell} | facts
    return [
        msgspec.structs.replace(node, attributes=attributes, samples=Array.of(samples)),
        *place_link(node, cell),
    ]


def _road(task: Task, rows: Floats) -> list[Operation]:
    """Each road node moves with the place nearest to it; what a turn would leave open between them
    is filled.
    """
    cells, values = _road_cells(task)
    if not len(cells):
        return []
    where = _moved(cells.astype(np.float64) * task.cell_m, rows[:, OLD], rows[:, NEW])
    arrived = np.rint(where / task.cell_m).astype(np.int64)
    around = np.unique((arrived[:, None, :] + AROUND).reshape(-1, 2), axis=0)
    came_from = np.rint(
        _moved(around * task.cell_m, rows[:, NEW], rows[:, OLD]) / task.cell_m
    ).astype(np.int64)
    road = dict(zip(_pairs(cells), values.tolist(), strict=True))
    result = dict.fromkeys(road, 0.0)
    sources = zip(_pairs(around), _pairs(came_from), strict=True)
    for cell, source in sources:
        if (value := road.get(source, 0.0)) > 0:
            result[cell] = max(result.get(cell, 0.0), value)
    for cell, value in zip(_pairs(arrived), values.tolist(), strict=True):
        result[cell] = max(result.get(cell, 0.0), value)
    changed = {cell: value for cell, value in result.items() if road.get(cell, 0.0) != value}
    return _cells(changed)


def _pairs(cells: Indices) -> list[tuple[int, int]]:
    return [(i, j) for i, j in cells.tolist()]


def _cells(values: dict[tuple[int, int], float]) -> list[Operation]:
    """New values of road nodes, so many at once as the workspace takes."""
    cells = np.array(list(values), np.int32).reshape(-1, 2)
    roads = np.array(list(values.values()), np.float32)
    starts = range(0, len(cells), 2**16)
    return [
        Cells(
            column="road",
            cells=Array.of(cells[k : k + 2**16]),
            values=Array.of(roads[k : k + 2**16]),
        )
        for k in starts
    ]


def _road_cells(task: Task) -> tuple[Indices, Floats]:
    """(k, 2) cells that are road, and how surely."""
    cells = [np.zeros((0, 2), np.int64)]
    values = [np.zeros(0)]
    for tile in task.tiles:
        road = np.asarray(tile.road.numpy(), np.float64)
        if road.shape != (TILE_SIDE, TILE_SIDE):
            raise MessageError(f"a tile of road of shape {road.shape}")
        i, j = np.nonzero(road)
        cells.append(np.column_stack([i + tile.x * TILE_SIDE, j + tile.y * TILE_SIDE]))
        values.append(road[i, j])
    return np.vstack(cells), np.concatenate(values)


def _moved(points: Floats, old: Floats, new: Floats) -> Floats:
    """(k, 2) points moved as the pose nearest to each is."""
    result = np.empty_like(points, dtype=np.float64)
    for start in range(0, len(points), AT_ONCE):
        some = points[start : start + AT_ONCE]
        nearest = ((some[:, None, :] - old[None, :, :2]) ** 2).sum(axis=2).argmin(axis=1)
        result[start : start + AT_ONCE] = move_with(some, old[nearest], new[nearest])
    return result
