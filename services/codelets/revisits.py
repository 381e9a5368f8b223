"""Views that may close a loop: a landmark recognised again after long, or a place by the views that led to it (§5.6).

A node of kind `closure` says that what stands `ahead_m` and `left_m` of where the agent was at `from_ns` was seen at
`range_m` and `bearing_rad` at `to_ns`, to `sd_m`. Of a place met again, that is the place itself, and the heading there
is known to `sd_rad`; a landmark tells none, and `sd_rad` is 0. Map correction says whether it `agrees` and `holds`.
"""

from __future__ import annotations

import numpy as np

from schemas.base import Scalar
from schemas.graph import Node, Operation
from schemas.mind import Task
from schemas.sensing import Percept, PlaceMatch
from services.codelets.agreement import AGREEING, Views
from services.codelets.path import POSE, STAMP, rows_of
from services.codelets.pose_graph import Constraints, Floats, relative, rotations
from services.codelets.sampling import wrapped
from services.codelets.settings import Config
from services.codelets.sightings import has_bearing, has_range

KIND = "closure"
BESIDE_M = 10.0

_Anchor = dict[str, Scalar]


def revisit(task: Task, config: Config) -> list[Operation]:
    """A closure for each percept and match of `task`, which has the landmarks, and the path where each was met before.

    Closures of the same landmark among its nodes are of the same pass: the landmark stands where it stood before that,
    whatever this pass has made of it. One that was not seen often where it stands may be a mistake, and closes nothing.
    """
    rows = rows_of(task.nodes)
    passing = {str(node.attributes["by"]): node for node in task.nodes if node.kind == KIND}
    landmarks = {node.attributes.get("label"): node for node in task.nodes if node.kind == "object"}
    found: list[Operation] = []
    for percept in task.percepts:
        if not (has_bearing(percept) and has_range(percept)):
            continue
        if (before := passing.get(percept.label)) is not None:
            anchor = {key: before.attributes[key] for key in ("from_ns", "ahead_m", "left_m")}
        elif _seen_often(landmarks[percept.label]):
            anchor = _stands(landmarks[percept.label], rows)
        else:
            continue
        found.append(_closure(task, percept.label, anchor | _sight(percept, anchor, config)))
    return found + [_closure(task, f"view-{match.frame}", _place(match, config)) for match in task.matches]


def _seen_often(landmark: Node) -> bool:
    facts = landmark.attributes
    return int(facts.get("sightings", 0)) - int(facts.get("misses", 0)) >= AGREEING


def _stands(landmark: Node, rows: Floats) -> _Anchor:
    """Where a landmark stands as seen from where the path first passed it by."""
    facts = landmark.attributes
    where = np.array([float(facts["x_m"]), float(facts["y_m"])])
    since = rows[rows[:, STAMP] >= int(facts["since_ns"]) * 1e-9 - 1e-6]
    near = since[first_pass(np.hypot(*(since[:, POSE][:, :2] - where).T))]
    ahead_m, left_m = (rotations(-near[None, 3])[0] @ (where - near[POSE][:2])).tolist()
    return {"from_ns": round(float(near[STAMP]) * 1e9), "ahead_m": ahead_m, "left_m": left_m}


def first_pass(away: Floats) -> int:
    """The nearest of the places, by (n,) distances along the path, where it first passes by.

    Not the nearest of all: where a loop has drifted, its end may lie nearer than the beginning that an object is of.
    """
    passing = np.flatnonzero(away <= max(2 * away.min(), away.min() + BESIDE_M))
    gone = np.flatnonzero(np.diff(passing) > 1)
    first = passing[: gone[0] + 1] if len(gone) else passing
    return int(first[away[first].argmin()])


def _sight(percept: Percept, anchor: _Anchor, config: Config) -> _Anchor:
    """It was located as well as it is seen now, while the agent came by."""
    seen2 = percept.range_sd_m**2 + (percept.range_m * percept.bearing_sd_rad) ** 2
    by_m = float(np.hypot(float(anchor["ahead_m"]), float(anchor["left_m"])))
    sd_m = float(np.sqrt(2 * seen2 + config.path_variance_per_m * (by_m + percept.range_m)))
    return {"range_m": percept.range_m, "bearing_rad": percept.bearing_rad, "sd_m": sd_m, "sd_rad": 0.0}


def _place(match: PlaceMatch, config: Config) -> _Anchor:
    here = dict.fromkeys(("ahead_m", "left_m", "range_m", "bearing_rad"), 0.0)
    return {"from_ns": match.view_ns, **here, "sd_m": config.place_match_sd_m, "sd_rad": config.place_match_sd_rad}


def _closure(task: Task, by: str, facts: _Anchor) -> Node:
    attributes = {**facts, "to_ns": task.stamp_ns, "by": by}
    return Node(id=f"{KIND}:{task.cycle}:{by}", kind=KIND, base_level=1.0, attributes=attributes)


def views_of(closures: list[Node], rows: Floats) -> Views:
    """The closures as views from rows of the path."""
    keys = ("ahead_m", "left_m", "range_m", "bearing_rad", "sd_m", "sd_rad")
    facts = np.array([[float(node.attributes[key]) for key in keys] for node in closures]).reshape(-1, len(keys))
    seen = facts[:, 2:3] * np.column_stack([np.cos(facts[:, 3]), np.sin(facts[:, 3])])
    stamps = np.array([[int(node.attributes[key]) for key in ("from_ns", "to_ns")] for node in closures]).reshape(-1, 2)
    ends = np.abs(rows[:, STAMP] - stamps[..., None] * 1e-9).argmin(axis=2)
    return Views(ends[:, 0], ends[:, 1], facts[:, :2], seen, facts[:, 4].clip(1e-3), facts[:, 5])


def constraints_of(views: Views, poses: Floats) -> Constraints:
    """The views as constraints between (n, 3) poses, near those.

    A landmark tells where the agent stands but for its heading: who is turned further stands elsewhere around it.
    """
    nothing = np.empty(0)
    turn = relative(poses, Constraints(views.first, views.second, nothing, nothing))[:, 2]
    turn = np.where(views.sd_rad > 0, 0.0, wrapped(turn))
    off = np.einsum("mab,mb->ma", rotations(turn), views.here_m)
    by_pose = np.zeros((len(turn), 2, 3))
    by_pose[:, 0, 0] = by_pose[:, 1, 1] = 1.0
    by_pose[:, :, 2] = np.column_stack([-off[:, 1], off[:, 0]])
    information = by_pose.transpose(0, 2, 1) @ by_pose / views.sd_m[:, None, None] ** 2
    known = views.sd_rad > 0
    information[known, 2, 2] += views.sd_rad[known] ** -2
    return Constraints(views.first, views.second, np.column_stack([views.there_m - off, turn]), information)
