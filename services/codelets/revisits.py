"""Loops that close: a landmark recognised again after long, or a place by the views that led to it (paper §5.6).

A node of kind `closure` says where the agent was at `to_ns` as seen from where it was at `from_ns`; nothing is known
of the heading where `sd_rad` is 0. `holds` is whether map correction believes it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bus.errors import MessageError
from bus.graph import object_id
from schemas.base import Scalar
from schemas.graph import Node
from schemas.mind import Task
from schemas.sensing import Percept, PlaceMatch
from services.codelets.path import POSE, STAMP, step_between, steps_of
from services.codelets.pose_graph import Constraints, Floats
from services.codelets.sampling import mean_pose
from services.codelets.settings import Config

KIND = "closure"
LEAST_ROWS = 10


class Fix(NamedTuple):
    """Where the agent stands, (3,), by what it was seen to be near at `before_ns`; `sd_rad` 0 is no word on heading."""

    before_ns: int
    stands: Floats
    sd_m: float
    sd_rad: float
    by: str


def found_again(task: Task, rows: Floats, config: Config) -> list[Node]:
    """The closures that the percepts and matches of `task` make, with the path of (n, COLUMNS) `rows`."""
    if len(rows) <= LEAST_ROWS:
        return []
    by_id = {node.id: node for node in task.nodes}
    closures = []
    for percept in task.percepts:
        landmark = by_id.get(object_id(percept.label))
        if landmark is not None:
            closures.append(_by_landmark(task, rows, landmark, percept, config))
    closures += [_by_match(task, rows, match, config) for match in task.matches]
    return [node for node in closures if _row(rows, node, "to_ns") - _row(rows, node, "from_ns") >= LEAST_ROWS]


def _pose(task: Task) -> Floats:
    agent = next(node for node in task.nodes if node.kind == "self")
    if agent.samples is None:
        raise MessageError(f"task {task.task_id} has a self node without samples")
    return mean_pose(np.asarray(agent.samples.numpy(), np.float64))


def _by_landmark(task: Task, rows: Floats, landmark: Node, percept: Percept, config: Config) -> Node:
    """The agent stands where the landmark is seen as it is; it was last seen when the path was at `from_ns`."""
    before_ns = int(landmark.attributes["stamp_ns"])
    pose = _pose(task)
    bearing = pose[2] + percept.bearing_rad
    where = np.array([float(landmark.attributes["x_m"]), float(landmark.attributes["y_m"])])
    stands = where - percept.range_m * np.array([np.cos(bearing), np.sin(bearing)])
    spread_m = np.hypot(float(landmark.attributes["x_sd_m"]), float(landmark.attributes["y_sd_m"]))
    # How far it stands off to the side is as unsure as the heading has become on the way.
    way = steps_of(rows[_nearest(rows, before_ns) :], config).information[:, 2, 2]
    across_rad = float(np.sqrt(percept.bearing_sd_rad**2 + (1 / way).sum()))
    sd_m = float(np.sqrt(spread_m**2 + percept.range_sd_m**2 + (percept.range_m * across_rad) ** 2))
    fix = Fix(before_ns, np.array([*stands, pose[2]]), sd_m, 0.0, percept.label)
    return _closure(task, rows, fix)


def _by_match(task: Task, rows: Floats, match: PlaceMatch, config: Config) -> Node:
    """The agent is where it was when it had the matching view, and looks the same way."""
    there = rows[_nearest(rows, match.view_ns), POSE]
    fix = Fix(match.view_ns, there, config.place_match_sd_m, config.place_match_sd_rad, f"view-{match.frame}")
    return _closure(task, rows, fix)


def _closure(task: Task, rows: Floats, fix: Fix) -> Node:
    """From the path's place at that time to its last, if the agent stands there and not where it believes to be."""
    last, stands, pose = rows[-1, POSE], fix.stands, _pose(task)
    # The last place of the path is a step behind: it would have been as far from where the agent stands.
    target = np.array([*(stands[:2] - pose[:2] + last[:2]), last[2] + stands[2] - pose[2]])
    measured = step_between(rows[_nearest(rows, fix.before_ns), POSE], target)
    attributes: dict[str, Scalar] = {
        "from_ns": fix.before_ns,
        "to_ns": task.stamp_ns,
        "forwards_m": float(measured[0]),
        "left_m": float(measured[1]),
        "turn_rad": float(measured[2]),
        "sd_m": fix.sd_m,
        "sd_rad": fix.sd_rad,
        "by": fix.by,
        "holds": False,
    }
    return Node(id=f"{KIND}:{task.cycle}:{fix.by}", kind=KIND, base_level=1.0, attributes=attributes)


def constraints_of(closures: list[Node], rows: Floats) -> Constraints:
    """The closures as constraints between rows of the path."""
    facts = np.array(
        [[float(node.attributes[key]) for key in ("forwards_m", "left_m", "turn_rad")] for node in closures]
    )
    spread = np.array([[float(node.attributes[key]) for key in ("sd_m", "sd_rad")] for node in closures]).reshape(-1, 2)
    information = np.zeros((len(closures), 3, 3))
    information[:, 0, 0] = information[:, 1, 1] = spread[:, 0].clip(1e-3) ** -2
    known = spread[:, 1] > 0
    information[known, 2, 2] = spread[known, 1] ** -2
    ends = [np.array([_row(rows, node, key) for node in closures], np.int64) for key in ("from_ns", "to_ns")]
    return Constraints(ends[0], ends[1], facts.reshape(-1, 3), information)


def _row(rows: Floats, closure: Node, key: str) -> int:
    return _nearest(rows, int(closure.attributes[key]))


def _nearest(rows: Floats, stamp_ns: int) -> int:
    return int(np.abs(rows[:, STAMP] - stamp_ns * 1e-9).argmin())
