"""The path that the agent took, as nodes of the graph: what map correction corrects (paper §5.6).

A node of kind `path` holds up to ROWS places on end. Each row of its samples is stamp_s, x_m, y_m, heading_rad, where
the agent takes itself to have been then, and the step to there from the place before, as path integration had it:
forwards_m, left_m, turn_rad. Corrections change the first, never the step.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bus.errors import MessageError
from schemas.array import Array
from schemas.graph import Node, Operation
from schemas.mind import Task
from services.codelets.pose_graph import Constraints, Floats, relative
from services.codelets.sampling import mean_pose, wrapped
from services.codelets.settings import Config

KIND = "path"
COLUMNS, ROWS = 7, 64
STAMP, POSE, STEP = 0, slice(1, 4), slice(4, 7)


def segment_id(number: int) -> str:
    """The name of a node of the path; they are numbered from 0."""
    return f"{KIND}:{number}"


def rows_of(nodes: Iterable[Node]) -> Floats:
    """(n, COLUMNS): the rows of all path nodes among `nodes`, the oldest first.

    Raises MessageError where one has samples of another shape.
    """
    segments = sorted((node for node in nodes if node.kind == KIND), key=lambda node: int(node.attributes["number"]))
    rows = [node.samples.numpy() for node in segments if node.samples is not None]
    if any(array.ndim != 2 or array.shape[1] != COLUMNS for array in rows):
        raise MessageError(f"a path whose rows are not {COLUMNS} numbers")
    return np.vstack([np.zeros((0, COLUMNS)), *rows]).astype(np.float64)


def segments(rows: Floats, first: int = 0) -> list[Operation]:
    """The path nodes of `rows`, which begin with that of number `first`."""
    starts = range(0, len(rows), ROWS)
    return [_segment(first + start // ROWS, rows[start : start + ROWS]) for start in starts]


def _segment(number: int, rows: Floats) -> Node:
    samples = Array.of(rows)
    return Node(id=segment_id(number), kind=KIND, base_level=1.0, attributes={"number": number}, samples=samples)


def extend_path(task: Task, config: Config) -> list[Operation]:
    """The place where the agent is now, added to the path's last node, which `task` has if there is any."""
    self_node = next(node for node in task.nodes if node.kind == "self")
    if self_node.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    pose = mean_pose(np.asarray(self_node.samples.numpy(), np.float64))
    last = next((node for node in task.nodes if node.kind == KIND), None)
    before = np.zeros((0, COLUMNS)) if last is None else rows_of([last])
    row = np.concatenate(
        [[task.stamp_ns * 1e-9], pose, step_between(before[-1, POSE], pose) if len(before) else [0.0] * 3]
    )
    number = 0 if last is None else int(last.attributes["number"])
    if len(before) < ROWS:
        return segments(np.vstack([before, row]), number)
    return segments(row[None], number + 1)


def step_between(before: Floats, after: Floats) -> Floats:
    """(3,): one pose as seen from another."""
    nothing = np.empty(0)
    both = Constraints(np.array([0]), np.array([1]), nothing, nothing)
    step: Floats = relative(np.vstack([before, after]), both)[0]
    step[2] = wrapped(step[2])
    return step


def steps_of(rows: Floats, config: Config) -> Constraints:
    """What path integration says from each row to the next, less surely the longer the step."""
    length = np.hypot(rows[1:, 4], rows[1:, 5]).clip(config.path_spacing_m / 2)
    turned = np.abs(rows[1:, 6])
    information = np.zeros((len(length), 3, 3))
    information[:, 0, 0] = information[:, 1, 1] = 1 / (config.path_variance_per_m * length)
    information[:, 2, 2] = 1 / (config.heading_variance_per_m * length + config.heading_variance_per_rad * turned)
    at = np.arange(len(length))
    return Constraints(at, at + 1, rows[1:, STEP], information)


def shifted(points: Floats, old: Floats, new: Floats) -> Floats:
    """(k, 2) points that stand to (k, 3) poses `new` as they stood to `old`."""
    turn = new[:, 2] - old[:, 2]
    off = points - old[:, :2]
    cos, sin = np.cos(turn), np.sin(turn)
    moved = np.column_stack([cos * off[:, 0] - sin * off[:, 1], sin * off[:, 0] + cos * off[:, 1]])
    result: Floats = new[:, :2] + moved
    return result
