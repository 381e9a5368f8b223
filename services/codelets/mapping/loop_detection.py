"""The loop detection codelet: views that may close a loop, of a landmark recognised again after
long, or of a place by the views that led to it (paper §5.6).

Map correction determines whether they are consistent with one another, and accepted.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.errors import MessageError
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.codelets import Task
from schemas.graph import Operation, Phase
from schemas.nodes import (
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathSegment,
    Self,
    object_id,
    segment_id,
)
from schemas.sensing import Percept, PlaceMatch
from services.codelets.config import SECTION, Config
from services.codelets.correction.pairwise_consistency import MIN_AGREEING, Views
from services.codelets.correction.pose_graph import Constraints
from services.codelets.localization.measurement_model import has_bearing, has_range
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import ODOMETRY, STAMP, path_grows, rows_of

SAME_M = 6.0
MIN_SD_M = 1e-3
PLACE_CUE = ""


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where a landmark comes again that was away for long, or the path grows along it
    since, or along a known path.
    """
    percepts = context.percepts
    again = _seen_again(percepts.objects, graph, context.stamp_ns, config)
    matches = _places_again(percepts.matches, graph, context.stamp_ns, config)
    if not again and not matches:
        return []

    about = [object_id(percept.label) for percept in again]
    task = context.task(CODELET.name, about, percepts=again, matches=matches)
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """A closure for each percept and match of `task`.

    Each view of a landmark is joined to an observation of its own, so that one mistake, now or
    then, makes one closure. Where the map has the landmark is not used: this pass may have moved
    it.
    """
    if not task.percepts and not task.matches:
        raise MessageError(f"task {task.task_id} has nothing that was seen again")

    newest = newest_closures(graph)
    operations: list[Operation] = []
    for percept in _seen_again(task.percepts, graph, task.stamp_ns, config):
        closure = _closure_by_landmark(percept, task, graph, newest.get(percept.label), config)
        if closure is not None:
            operations.append(closure)

    for match in task.matches:
        operations.append(_closure_by_place(match, task, config))
    return Answer(operations)


CODELET = Codelet(
    name="loop_detection",
    phase=Phase.OBJECTS,
    due=due,
    run=run,
    reads=frozenset({Self, Object, PathSegment, Observations, LoopClosure, LinkKind.OBSERVES}),
    writes=frozenset({LoopClosure}),
    config=Config,
    section=SECTION,
)


def newest_closures(graph: Graph) -> dict[str, LoopClosure]:
    """The newest closure by each landmark, and by places, under PLACE_CUE."""
    newest: dict[str, LoopClosure] = {}
    closures = sorted(graph.of_kind(LoopClosure), key=lambda closure: closure.to_ns)

    for closure in closures:
        cue = PLACE_CUE if closure.sd_rad else closure.cue
        newest[cue] = closure

    return newest


def _seen_again(
    percepts: Iterable[Percept], graph: Graph, now_ns: int, config: Config
) -> list[Percept]:
    """The percepts of landmarks that come again: last seen, or closing a loop, long ago; or closing
    one on this pass, where the path has grown since.
    """
    long_ago_ns = now_ns - config.revisit_s * 1e9
    soon_ns = now_ns - config.closure_spacing_s * 1e9
    known = [percept for percept in percepts if percept.whole]
    known = [percept for percept in known if object_id(percept.label) in graph.nodes]
    if not known:
        return []

    grows = path_grows(graph, config)
    newest = newest_closures(graph)
    again = []
    for percept in known:
        landmark = graph.get(Object, object_id(percept.label))
        closure = newest.get(percept.label)

        if closure is not None and closure.to_ns > long_ago_ns:
            is_again = grows and closure.to_ns <= soon_ns
        else:
            is_again = landmark is not None and 0 <= landmark.last_seen_ns <= long_ago_ns

        if is_again:
            again.append(percept)

    return again


def _places_again(
    matches: Iterable[PlaceMatch], graph: Graph, now_ns: int, config: Config
) -> list[PlaceMatch]:
    """The matches of places that were seen long ago, where the path has grown since the last."""
    long_ago_ns = now_ns - config.revisit_s * 1e9
    found = [match for match in matches if match.view_ns <= long_ago_ns]
    if not found or not path_grows(graph, config):
        return []

    newest = newest_closures(graph).get(PLACE_CUE)
    soon_ns = now_ns - config.closure_spacing_s * 1e9
    if newest is not None and newest.to_ns > soon_ns:
        return []
    return found


def _closure_by_landmark(
    percept: Percept, task: Task, graph: Graph, newest: LoopClosure | None, config: Config
) -> LoopClosure | None:
    """A closure to one of the landmark's observations before; None where these are too few.

    The pass before ended where `newest` began this one, or the landmark was last seen.
    """
    landmark = graph.get(Object, object_id(percept.label))
    if landmark is None or not (has_bearing(percept) and has_range(percept)):
        return None

    long_ago_ns = task.stamp_ns - config.revisit_s * 1e9
    if newest is not None and newest.to_ns > long_ago_ns:
        before_ns = newest.before_ns
        view = newest.view
    else:
        before_ns = landmark.last_seen_ns
        view = 0

    observations, rows = _observed(landmark, graph)
    seen = Sightings.of(observations, rows[:, STAMP])
    there = _clearest(seen, rows, before_ns)
    if len(there) < MIN_AGREEING:
        return None

    chosen = int(there[view % len(there)])
    from_s = float(rows[seen.place[chosen], STAMP])
    ahead_m, left_m = seen.where_m[chosen].tolist()
    variance_there_m2 = 1 / float(np.linalg.eigvalsh(seen.information[chosen])[0])

    across_sd_m = percept.range_m * percept.bearing_sd_rad
    variance_here_m2 = percept.range_sd_m**2 + across_sd_m**2
    return LoopClosure(
        id=_closure_id(task, percept.label),
        base_level=1.0,
        from_ns=round(from_s * 1e9),
        to_ns=task.stamp_ns,
        cue=percept.label,
        ahead_m=ahead_m,
        left_m=left_m,
        range_m=percept.range_m,
        bearing_rad=percept.bearing_rad,
        sd_m=float(np.sqrt(variance_there_m2 + variance_here_m2)),
        sd_rad=0.0,
        before_ns=before_ns,
        view=view + 1,
    )


def _closure_by_place(match: PlaceMatch, task: Task, config: Config) -> LoopClosure:
    cue = f"view-{match.frame}"
    return LoopClosure(
        id=_closure_id(task, cue),
        base_level=1.0,
        from_ns=match.view_ns,
        to_ns=task.stamp_ns,
        cue=cue,
        ahead_m=0.0,
        left_m=0.0,
        range_m=0.0,
        bearing_rad=0.0,
        sd_m=config.place_match_sd_m,
        sd_rad=config.place_match_sd_rad,
    )


def _closure_id(task: Task, cue: str) -> str:
    return f"closure:{task.cycle}:{cue}"


def _observed(landmark: Object, graph: Graph) -> tuple[list[Observations], Floats]:
    """All observations of a landmark, and the rows of the path segments they were made along."""
    observations = []
    for name in graph.links.sources(landmark.id, LinkKind.OBSERVES):
        node = graph.get(Observations, name)
        if node is not None:
            observations.append(node)

    path = []
    for number in sorted({node.number for node in observations}):
        segment = graph.get(PathSegment, segment_id(number))
        if segment is not None:
            path.append(segment)

    return observations, rows_of(path)


def _clearest(seen: Sightings, rows: Floats, before_ns: int) -> Indices:
    """The sightings of a landmark that most others agree with, up to `before_ns`, those from
    nearest first.

    On one pass by, they lead to the same place by path integration alone.
    """
    until_s = before_ns * 1e-9 + 1e-6
    known = np.flatnonzero(rows[seen.place, STAMP] <= until_s)
    if not len(known):
        return known

    stood = rows[seen.place[known], ODOMETRY]
    turn = rotation_matrices(stood[:, 2])
    where_m = stood[:, :2] + np.einsum("mab,mb->ma", turn, seen.where_m[known])
    apart_m = np.hypot(*(where_m[:, None] - where_m).transpose(2, 0, 1))

    is_same = apart_m <= SAME_M
    agreeing = is_same.sum(axis=1)
    chosen = known[is_same[agreeing.argmax()]]

    distance_m = np.hypot(*seen.where_m[chosen].T)
    nearest_first = np.argsort(distance_m, kind="stable")
    order: Indices = chosen[nearest_first]
    return order


def views_of(closures: list[LoopClosure], rows: Floats) -> Views:
    """The closures as views from rows of the path."""
    range_m = np.array([closure.range_m for closure in closures])
    bearing_rad = np.array([closure.bearing_rad for closure in closures])
    direction = np.column_stack([np.cos(bearing_rad), np.sin(bearing_rad)])
    here_m = range_m[:, None] * direction

    ahead_left_m = [[closure.ahead_m, closure.left_m] for closure in closures]
    there_m = np.array(ahead_left_m).reshape(-1, 2)

    from_to_ns = [[closure.from_ns, closure.to_ns] for closure in closures]
    stamps_ns = np.array(from_to_ns).reshape(-1, 2)
    away_s = np.abs(rows[:, STAMP] - stamps_ns[..., None] * 1e-9)
    ends = away_s.argmin(axis=2)

    sd_m = np.array([closure.sd_m for closure in closures]).clip(MIN_SD_M)
    sd_rad = np.array([closure.sd_rad for closure in closures])
    return Views(ends[:, 0], ends[:, 1], there_m, here_m, sd_m, sd_rad)


def constraints_of(views: Views, poses: Floats) -> Constraints:
    """The views as constraints between (n, 3) poses, near those.

    A landmark determines the agent's position given its heading alone: with another heading the
    agent stands elsewhere around it.
    """
    has_heading = views.sd_rad > 0
    step = relative(poses[views.i], poses[views.j])
    turn_rad = np.where(has_heading, 0.0, step[:, 2])
    seen_m = np.einsum("mab,mb->ma", rotation_matrices(turn_rad), views.here_m)
    measured = np.column_stack([views.there_m - seen_m, turn_rad])

    jacobian = np.zeros((len(turn_rad), 2, 3))
    jacobian[:, 0, 0] = 1.0
    jacobian[:, 1, 1] = 1.0
    jacobian[:, :, 2] = np.column_stack([-seen_m[:, 1], seen_m[:, 0]])

    variance_m2 = views.sd_m[:, None, None] ** 2
    information = jacobian.transpose(0, 2, 1) @ jacobian / variance_m2
    information[has_heading, 2, 2] += views.sd_rad[has_heading] ** -2
    return Constraints(views.i, views.j, measured, information)
