"""The loop detection codelet: views that may close a loop, of a landmark recognised again after
long, or of a place by the views that led to it (paper §5.6).

Map correction determines whether they are consistent with one another, and accepted.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from cogmap.errors import MessageError
from cogmap.estimation.pairwise_consistency import MIN_AGREEING
from cogmap.estimation.pose_graph import matvec
from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Operation, Phase
from cogmap.schemas.nodes import (
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathSegment,
    Self,
    object_id,
    segment_id,
)
from cogmap.schemas.sensing import Percept, PlaceMatch
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import ODOMETRY, STAMP, path_grows
from cogmap.services.codelets.nodes import nodes_of

SAME_M = 6.0
PLACE_CUE = ""


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where a landmark comes again that was away for long, or the path grows along it
    since, or along a known path.
    """
    percepts = context.percepts
    now_ns = context.stamp_ns
    again = _seen_again(percepts.objects, graph, now_ns, config)
    matches = _places_again(percepts.matches, graph, now_ns, config)
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
        closure_before = newest.get(percept.label)
        closure = _closure_by_landmark(percept, task, graph, closure_before, config)
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
    known = _known(percepts, graph)
    if not known:
        return []

    grows = path_grows(graph, config)
    newest = newest_closures(graph)
    long_ago_ns = _long_ago_ns(now_ns, config)
    again = []
    for percept in known:
        closure = newest.get(percept.label)
        if closure is not None and closure.to_ns > long_ago_ns:
            is_again = grows and closure.to_ns <= _recently_ns(now_ns, config)
        else:
            is_again = _is_last_seen_by(long_ago_ns, percept.label, graph)

        if is_again:
            again.append(percept)

    return again


def _known(percepts: Iterable[Percept], graph: Graph) -> list[Percept]:
    """The percepts of whole objects that the graph has."""
    known = []
    for percept in percepts:
        if percept.whole and object_id(percept.label) in graph.nodes:
            known.append(percept)

    return known


def _is_last_seen_by(stamp_ns: float, label: str, graph: Graph) -> bool:
    """Whether the map has a landmark that was seen, and not since `stamp_ns`."""
    landmark = graph.get(Object, object_id(label))
    if landmark is None:
        return False

    return 0 <= landmark.last_seen_ns <= stamp_ns


def _long_ago_ns(now_ns: int, config: Config) -> float:
    """What was seen last up to then, and is seen now, comes again."""
    return now_ns - config.revisit_s * 1e9


def _recently_ns(now_ns: int, config: Config) -> float:
    """A loop that was closed since then is not closed again."""
    return now_ns - config.closure_spacing_s * 1e9


def _places_again(
    matches: Iterable[PlaceMatch], graph: Graph, now_ns: int, config: Config
) -> list[PlaceMatch]:
    """The matches of places that were seen long ago, where the path has grown since the last."""
    long_ago_ns = _long_ago_ns(now_ns, config)
    found = [match for match in matches if match.view_ns <= long_ago_ns]
    if not found or not path_grows(graph, config):
        return []

    newest = newest_closures(graph).get(PLACE_CUE)
    if newest is not None and newest.to_ns > _recently_ns(now_ns, config):
        return []

    return found


def _closure_by_landmark(
    percept: Percept, task: Task, graph: Graph, newest: LoopClosure | None, config: Config
) -> LoopClosure | None:
    """A closure to one of the landmark's observations before; None where these are too few.

    The pass before ended where `newest` began this one, or the landmark was last seen.
    """
    landmark = graph.get(Object, object_id(percept.label))
    if landmark is None or not (percept.has_bearing and percept.has_range):
        return None

    long_ago_ns = _long_ago_ns(task.stamp_ns, config)
    before_ns, view = _earlier_pass(landmark, newest, long_ago_ns)
    observations, rows = _observed(landmark, graph)
    seen = Sightings.of(observations, rows[:, STAMP])
    there = _clearest(seen, rows, before_ns)
    if len(there) < MIN_AGREEING:
        return None

    chosen = int(there[view % len(there)])
    from_s = float(rows[seen.place[chosen], STAMP])
    ahead_m, left_m = seen.where_m[chosen].tolist()
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
        sd_m=_sd_m(percept, seen.information[chosen]),
        sd_rad=0.0,
        before_ns=before_ns,
        view=view + 1,
    )


def _earlier_pass(
    landmark: Object, newest: LoopClosure | None, long_ago_ns: float
) -> tuple[int, int]:
    """Until when the pass before saw the landmark, and how many closures to it were made on this
    pass.
    """
    if newest is not None and newest.to_ns > long_ago_ns:
        return newest.before_ns, newest.view

    return landmark.last_seen_ns, 0


def _sd_m(percept: Percept, information: Floats) -> float:
    """The standard deviation of a closure: of the percept now, and of the observation before, by
    its (2, 2) information.
    """
    least_information = np.linalg.eigvalsh(information)[0]
    variance_there_m2 = 1 / float(least_information)

    across_sd_m = percept.range_m * percept.bearing_sd_rad
    variance_here_m2 = percept.range_sd_m**2 + across_sd_m**2

    sd_m = np.sqrt(variance_there_m2 + variance_here_m2)
    return float(sd_m)


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
    names = graph.links.sources(landmark.id, LinkKind.OBSERVES)
    observations = nodes_of(graph, Observations, names)

    numbers = sorted({node.number for node in observations})
    segments = [segment_id(number) for number in numbers]
    path = nodes_of(graph, PathSegment, segments)
    return observations, rows_of(path)


def _clearest(seen: Sightings, rows: Floats, before_ns: int) -> Indices:
    """The sightings of a landmark that most others agree with, up to `before_ns`, those from
    nearest first.

    On one pass by, they lead to the same place by path integration alone.
    """
    until_s = before_ns * 1e-9 + 1e-6
    stamps_s = rows[seen.place, STAMP]
    known = np.flatnonzero(stamps_s <= until_s)
    if not len(known):
        return known

    where_m = _where_by_odometry_m(seen, rows, known)
    chosen = known[_most_agreeing(where_m)]

    distance_m = np.hypot(*seen.where_m[chosen].T)
    nearest_first = np.argsort(distance_m, kind="stable")
    order: Indices = chosen[nearest_first]
    return order


def _where_by_odometry_m(seen: Sightings, rows: Floats, known: Indices) -> Floats:
    """(k, 2): where the `known` sightings place their landmark by path integration alone."""
    places = seen.place[known]
    poses = rows[places, ODOMETRY]

    turn = rotation_matrices(poses[:, 2])
    offset_m = matvec(turn, seen.where_m[known])
    where_m: Floats = poses[:, :2] + offset_m
    return where_m


def _most_agreeing(points_m: Floats) -> Booleans:
    """(k,): which of (k, 2) points are near the one that most of them are near."""
    is_near = _apart_m(points_m) <= SAME_M
    near_count = is_near.sum(axis=1)

    chosen: Booleans = is_near[near_count.argmax()]
    return chosen


def _apart_m(points_m: Floats) -> Floats:
    """(k, k): how far (k, 2) points are from one another."""
    offset_m = points_m[:, None] - points_m
    x_m, y_m = offset_m.transpose(2, 0, 1)

    apart_m: Floats = np.hypot(x_m, y_m)
    return apart_m
