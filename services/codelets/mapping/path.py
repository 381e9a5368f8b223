"""The path that the agent took, as nodes of the graph: what map correction corrects (paper §5.6).

A node of kind `path` holds up to ROWS places on end. Each row of its samples is stamp_s, then x_m,
y_m, heading_rad where the agent takes itself to have been, then the same where path integration
alone would have had it, and by which variance, of the way in m^2 and of the heading in rad^2,
summed up from the start. Landmarks and corrections change the agent's own belief; the steps between
the latter are what self-motion says, and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import mean_pose, relative
from schemas.array import Array
from schemas.cognition import Task
from schemas.graph import Node, Operation
from services.codelets.config import Config
from services.codelets.correction.pose_graph import Constraints
from services.codelets.localization.measurement_model import has_bearing, has_range
from services.codelets.mapping.observations import Outlook, recorded, seen_from, sighted_id

KIND = "path"
COLUMNS = 9
ROWS = 64
STAMP = 0
POSE = slice(1, 4)
ODOMETRY = slice(4, 7)
VARIANCES = slice(7, 9)
ODOMETRY_FACTS = ("odometry_x_m", "odometry_y_m", "odometry_heading_rad")
VARIANCE_FACTS = ("odometry_variance_m2", "odometry_variance_rad2")


def segment_id(number: int) -> str:
    """The name of a node of the path; they are numbered from 0."""
    return f"{KIND}:{number}"


def rows_of(nodes: Iterable[Node]) -> Floats:
    """(n, COLUMNS): the rows of all path nodes among `nodes`, the oldest first.

    Raises MessageError where one has samples of another shape.
    """
    segments = sorted(
        (node for node in nodes if node.kind == KIND),
        key=lambda node: int(node.attributes["number"]),
    )
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
    return Node(
        id=segment_id(number),
        kind=KIND,
        base_level=1.0,
        attributes={"number": number},
        samples=samples,
    )


def extend_path(task: Task, config: Config) -> list[Operation]:
    """The place where the agent is now, added to the path's last node, and what landmarks are seen
    from there.

    `task` has the last node, if there is any, and what was seen along it of the landmarks in its
    percepts. Where the agent has hardly moved from the last place, they are seen from that.
    """
    self_node = next(node for node in task.nodes if node.kind == "self")
    if self_node.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    last = next((node for node in task.nodes if node.kind == KIND), None)
    rows = np.zeros((0, COLUMNS)) if last is None else rows_of([last])
    number = 0 if last is None else int(last.attributes["number"])
    pose = mean_pose(np.asarray(self_node.samples.numpy(), np.float64))
    odometry = odometry_of(self_node)
    written: list[Operation] = []
    if is_apart(rows, odometry, config.path_spacing_m) or is_lost_since(rows, self_node):
        row = np.concatenate([[task.stamp_ns * 1e-9], pose, odometry, variances_of(self_node)])[
            None
        ]
        number, rows = (number + 1, row) if len(rows) >= ROWS else (number, np.vstack([rows, row]))
        written += segments(rows, number)
    stamp_s = float(rows[-1, STAMP])
    step = relative(rows[-1, ODOMETRY], odometry)
    outlook = Outlook(number, stamp_s, step, float(self_node.attributes.get("range_gain", 0.0)))
    before = {node.id: node for node in task.nodes}
    for percept in task.percepts:
        sightings = before.get(sighted_id(number, percept.label))
        if has_range(percept) and has_bearing(percept) and not seen_from(sightings, stamp_s):
            written.append(recorded(sightings, outlook, percept))
    return written


def is_apart(rows: Floats, odometry: Floats, spacing_m: float) -> bool:
    """Whether path integration leads `spacing_m` or more from the last of the (n, COLUMNS) rows, or
    there is none.
    """
    return not len(rows) or bool(np.hypot(*(rows[-1, ODOMETRY][:2] - odometry[:2])) >= spacing_m)


def is_lost_since(rows: Floats, self_node: Node) -> bool:
    """Whether the agent has got lost since the last of the rows: what it sees now, it may see from
    elsewhere.
    """
    facts = self_node.attributes
    return (
        bool(facts.get("others", False))
        and float(rows[-1, STAMP]) <= int(facts.get("fits_ns", 0)) * 1e-9
    )


def odometry_of(self_node: Node) -> Floats:
    """(3,): where path integration alone would have the agent; where that is not known, where it
    takes itself to be.
    """
    facts = self_node.attributes
    own = [float(facts[key]) for key in ("x_m", "y_m", "heading_rad")]
    return np.array(
        [float(facts.get(key, other)) for key, other in zip(ODOMETRY_FACTS, own, strict=True)]
    )


def variances_of(self_node: Node) -> Floats:
    """(2,): the variance of the way, in m^2, and of the heading, in rad^2, by path integration
    since the start.
    """
    return np.array([float(self_node.attributes.get(key, 0.0)) for key in VARIANCE_FACTS])


def steps_of(rows: Floats, config: Config) -> Constraints:
    """What path integration says from each row to the next, as surely as self-motion says, or less,
    by the way.
    """
    at = np.arange(max(0, len(rows) - 1))
    odometry = rows[:, ODOMETRY]
    steps = relative(odometry[:-1], odometry[1:])
    length = np.hypot(steps[:, 0], steps[:, 1]).clip(config.path_spacing_m / 2)
    turned = np.abs(steps[:, 2])
    said_m2, said_rad2 = np.diff(rows[:, VARIANCES], axis=0).T
    least_rad2 = config.heading_variance_per_m * length + config.heading_variance_per_rad * turned
    information = np.zeros((len(length), 3, 3))
    information[:, 0, 0] = information[:, 1, 1] = 1 / np.maximum(
        config.path_variance_per_m * length, said_m2
    )
    information[:, 2, 2] = 1 / np.maximum(least_rad2, said_rad2)
    return Constraints(at, at + 1, steps, information)
