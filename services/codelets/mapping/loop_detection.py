"""Views that may close a loop: a landmark recognised again after long, or a place by the views that
led to it (§5.6).

A node of kind `closure` says that what stands `ahead_m` and `left_m` of where the agent was at
`from_ns` was seen at `range_m` and `bearing_rad` at `to_ns`, to `sd_m`. Of a place met again, that
is the place itself, and the heading there is known to `sd_rad`; a landmark tells none, and `sd_rad`
is 0. Map correction says whether it `agrees` and `holds`.
"""

from __future__ import annotations

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices
from schemas.base import Scalar
from schemas.cognition import Task
from schemas.graph import Node, Operation
from schemas.sensing import Percept, PlaceMatch
from services.codelets.config import Config
from services.codelets.correction.pairwise_consistency import MIN_AGREEING, Views
from services.codelets.correction.pose_graph import (
    Constraints,
)
from services.codelets.localization.measurement_model import has_bearing, has_range
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import ODOMETRY, STAMP, rows_of

KIND = "closure"
SAME_M = 6.0

_Facts = dict[str, Scalar]


def revisit(task: Task, config: Config) -> list[Operation]:
    """A closure for each percept and match of `task`.

    It has the landmarks, or the newest closures that they have made on this pass, all sightings of
    them, and the path along which these were made. Each view of a landmark is joined to a sighting
    of its own, so that one mistake, now or then, makes one closure. What the map has the landmark
    at does not come into it: this pass may have moved it.
    """
    if not task.percepts and not task.matches:
        raise MessageError(f"task {task.task_id} has nothing that was met again")
    rows = rows_of(task.nodes)
    seen = Sightings.of(task.nodes, rows[:, STAMP])
    found: list[Operation] = []
    for percept in task.percepts:
        begun = next(
            node
            for node in task.nodes
            if percept.label in (node.attributes.get(key) for key in ("label", "by"))
        )
        before_ns, number = (int(begun.attributes.get(key, 0)) for key in ("before_ns", "view"))
        before_ns = before_ns or int(begun.attributes["stamp_ns"])
        there = _clearest(seen, percept.label, rows, before_ns)
        if len(there) < MIN_AGREEING or not (has_bearing(percept) and has_range(percept)):
            continue
        facts = _joined(seen, int(there[number % len(there)]), rows, percept)
        found.append(
            _closure(task, percept.label, facts | {"before_ns": before_ns, "view": number + 1})
        )
    return found + [
        _closure(task, f"view-{match.frame}", _place(match, config)) for match in task.matches
    ]


def _clearest(seen: Sightings, label: str, rows: Floats, before_ns: int) -> Indices:
    """The sightings of a landmark that most others agree with, up to `before_ns`, those from
    nearest first.

    On one pass by, they lead to the same place by path integration alone.
    """
    known = np.flatnonzero(rows[seen.place, STAMP] <= before_ns * 1e-9 + 1e-6)
    known = known[[seen.labels[index] == label for index in seen.landmark[known].tolist()]]
    stood = rows[seen.place[known], ODOMETRY]
    where = stood[:, :2] + np.einsum(
        "mab,mb->ma", rotation_matrices(stood[:, 2]), seen.where_m[known]
    )
    same = np.hypot(*(where[:, None] - where).transpose(2, 0, 1)) <= SAME_M
    chosen = known[same[same.sum(axis=1).argmax()]] if len(known) else known
    order: Indices = chosen[np.argsort(np.hypot(*seen.where_m[chosen].T), kind="stable")]
    return order


def _joined(seen: Sightings, there: int, rows: Floats, percept: Percept) -> _Facts:
    ahead_m, left_m = seen.where_m[there].tolist()
    there_m2 = 1 / float(np.linalg.eigvalsh(seen.information[there])[0])
    here_m2 = percept.range_sd_m**2 + (percept.range_m * percept.bearing_sd_rad) ** 2
    return {
        "from_ns": round(float(rows[seen.place[there], STAMP]) * 1e9),
        "ahead_m": ahead_m,
        "left_m": left_m,
        "range_m": percept.range_m,
        "bearing_rad": percept.bearing_rad,
        "sd_m": float(np.sqrt(there_m2 + here_m2)),
        "sd_rad": 0.0,
    }


def _place(match: PlaceMatch, config: Config) -> _Facts:
    here = dict.fromkeys(("ahead_m", "left_m", "range_m", "bearing_rad"), 0.0)
    return {
        "from_ns": match.view_ns,
        **here,
        "sd_m": config.place_match_sd_m,
        "sd_rad": config.place_match_sd_rad,
    }


def _closure(task: Task, by: str, facts: _Facts) -> Node:
    attributes = {**facts, "to_ns": task.stamp_ns, "by": by}
    return Node(id=f"{KIND}:{task.cycle}:{by}", kind=KIND, base_level=1.0, attributes=attributes)


def views_of(closures: list[Node], rows: Floats) -> Views:
    """The closures as views from rows of the path."""
    keys = ("ahead_m", "left_m", "range_m", "bearing_rad", "sd_m", "sd_rad")
    facts = np.array([[float(node.attributes[key]) for key in keys] for node in closures]).reshape(
        -1, len(keys)
    )
    seen = facts[:, 2:3] * np.column_stack([np.cos(facts[:, 3]), np.sin(facts[:, 3])])
    stamps = np.array(
        [[int(node.attributes[key]) for key in ("from_ns", "to_ns")] for node in closures]
    ).reshape(-1, 2)
    ends = np.abs(rows[:, STAMP] - stamps[..., None] * 1e-9).argmin(axis=2)
    return Views(ends[:, 0], ends[:, 1], facts[:, :2], seen, facts[:, 4].clip(1e-3), facts[:, 5])


def constraints_of(views: Views, poses: Floats) -> Constraints:
    """The views as constraints between (n, 3) poses, near those.

    A landmark tells where the agent stands but for its heading: who is turned further stands
    elsewhere around it.
    """
    turn = relative(poses[views.i], poses[views.j])[:, 2]
    turn = np.where(views.sd_rad > 0, 0.0, turn)
    off = np.einsum("mab,mb->ma", rotation_matrices(turn), views.here_m)
    by_pose = np.zeros((len(turn), 2, 3))
    by_pose[:, 0, 0] = by_pose[:, 1, 1] = 1.0
    by_pose[:, :, 2] = np.column_stack([-off[:, 1], off[:, 0]])
    information = by_pose.transpose(0, 2, 1) @ by_pose / views.sd_m[:, None, None] ** 2
    known = views.sd_rad > 0
    information[known, 2, 2] += views.sd_rad[known] ** -2
    return Constraints(views.i, views.j, np.column_stack([views.there_m - off, turn]), information)
