"""The loop detection codelet: views that may close a loop, of a landmark recognised again after
long, or of a place by the views that led to it (paper §5.6).

Map correction determines whether they are consistent with one another, and accepted.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec
import numpy as np

from cogmap.errors import MessageError
from cogmap.estimation.pairwise_consistency import MIN_AGREEING
from cogmap.geometry.se2 import relative, transform_from
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Operation, Phase
from cogmap.schemas.nodes import (
    NEVER_NS,
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathSegment,
    Self,
    object_id,
    segment_id,
)
from cogmap.schemas.sensing import Percept
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import ODOMETRY, STAMP, path_grows
from cogmap.services.codelets.nodes import nodes_of

# Observations of a landmark on one pass agree if they place it at most so far apart.
SAME_M = 6.0
PLACE_CUE = ""


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task if a landmark comes again after long, or the path has grown along it since,
    or along a known path.
    """
    percepts = context.percepts
    long_ago_ns = context.stamp_ns - config.revisit_s * 1e9
    again = _seen_again(percepts.objects, graph, context.stamp_ns, config)
    matches = [match for match in percepts.matches if match.view_ns <= long_ago_ns]
    if config.closes_by == "sighting":
        # The paper's agent recognises landmarks alone.
        matches = []
    if matches:
        newest = newest_closures(graph).get(PLACE_CUE)
        recently_ns = context.stamp_ns - config.closure_spacing_s * 1e9
        is_closed = newest is not None and newest.to_ns > recently_ns
        matches = [] if is_closed or not path_grows(graph, config) else matches

    if not again and not matches:
        return []

    about = [object_id(percept.label) for percept in again]
    return [context.task(CODELET.name, about, percepts=again, matches=matches)]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Make a closure for each percept and match of `task`.

    Each view of a landmark is joined to an observation of its own, so that one mistake, now or
    then, makes one closure. The landmark's position on the map is not used: this pass may have
    moved it.
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
        cue = f"view-{match.frame}"
        closure = LoopClosure(
            id=f"closure:{task.cycle}:{cue}",
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
        operations.append(closure)

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


def is_range_alone(percept: Percept) -> bool:
    """Decide whether a landmark is seen by its range, without a bearing."""
    return percept.has_range and not percept.has_bearing


def newest_closures(graph: Graph) -> dict[str, LoopClosure]:
    """Find the newest closure by each landmark, and by places, under PLACE_CUE."""
    closures = sorted(graph.of_kind(LoopClosure), key=lambda closure: closure.to_ns)
    return {PLACE_CUE if each.sd_rad else each.cue: each for each in closures}


def _seen_again(
    percepts: Iterable[Percept], graph: Graph, now_ns: int, config: Config
) -> list[Percept]:
    """Choose the percepts of landmarks that come again: last seen, or closing a loop, long ago; or
    closing one on this pass, if the path has grown since. A landmark whose sighting closes a loop
    closes one on a pass.
    """
    known = [each for each in percepts if each.whole and object_id(each.label) in graph.nodes]
    if not known:
        return []

    grows = path_grows(graph, config)
    newest = newest_closures(graph)
    long_ago_ns = now_ns - config.revisit_s * 1e9
    recently_ns = now_ns - config.closure_spacing_s * 1e9
    again = []
    for percept in known:
        closure = newest.get(percept.label)
        landmark = graph.get(Object, object_id(percept.label))
        if is_range_alone(percept):
            # Heard all the time: it comes again as the path grows, and never after long.
            heard_ns = NEVER_NS if landmark is None else landmark.created_ns
            since_ns = heard_ns if closure is None else closure.to_ns
            is_again = grows and NEVER_NS < since_ns <= long_ago_ns
        elif config.closes_by == "sighting":
            is_again = landmark is not None and 0 <= landmark.last_seen_ns <= long_ago_ns
        elif closure is not None and closure.to_ns > long_ago_ns:
            is_again = grows and closure.to_ns <= recently_ns
        else:
            is_again = landmark is not None and 0 <= landmark.last_seen_ns <= long_ago_ns

        if is_again:
            again.append(percept)

    return again


def _closure_by_landmark(
    percept: Percept, task: Task, graph: Graph, newest: LoopClosure | None, config: Config
) -> LoopClosure | None:
    """Make a closure to one of the landmark's observations before; None if these are too few."""
    landmark = graph.get(Object, object_id(percept.label))
    if landmark is None or not percept.has_range:
        return None
    if is_range_alone(percept):
        return _closure_by_range(percept, task, landmark)

    to_ns = task.stamp_ns
    is_exact = config.closes_by == "sighting" or config.landmarks == "points"
    if is_exact and not path_grows(graph, config):
        percept, to_ns = _seen_from_path(percept, graph)

    # The pass before ended where `newest` began this one, or the landmark was last seen.
    before_ns, view = landmark.last_seen_ns, 0
    if newest is not None and newest.to_ns > task.stamp_ns - config.revisit_s * 1e9:
        before_ns, view = newest.before_ns, newest.view

    names = graph.links.sources(landmark.id, LinkKind.OBSERVES)
    observations = nodes_of(graph, Observations, names)
    numbers = sorted({node.number for node in observations})
    rows = rows_of(nodes_of(graph, PathSegment, [segment_id(number) for number in numbers]))
    seen = Sightings.of(observations, rows[:, STAMP])
    known = np.flatnonzero(rows[seen.place, STAMP] <= before_ns * 1e-9 + 1e-6)
    enough = 1 if config.closes_by == "sighting" else MIN_AGREEING
    if len(known) < enough:
        return None

    # Those up to then that most others agree with, from the nearest on: on one pass by, they lead
    # to the same place by path integration alone.
    where_m = transform_from(rows[seen.place[known], ODOMETRY], seen.where_m[known])
    offset_m = where_m[:, None] - where_m
    is_near = np.hypot(offset_m[..., 0], offset_m[..., 1]) <= SAME_M
    there = known[is_near[is_near.sum(axis=1).argmax()]]
    if len(there) < enough:
        return None
    there = there[np.argsort(np.hypot(*seen.where_m[there].T), kind="stable")]

    # It is as uncertain as the percept now and the observation then.
    chosen = int(there[view % len(there)])
    there_m2 = 1 / float(np.linalg.eigvalsh(seen.information[chosen])[0])
    here_m2 = percept.range_sd_m**2 + (percept.range_m * percept.bearing_sd_rad) ** 2
    from_s = float(rows[seen.place[chosen], STAMP])
    ahead_m, left_m = seen.where_m[chosen].tolist()
    return LoopClosure(
        id=f"closure:{task.cycle}:{percept.label}",
        base_level=1.0,
        from_ns=round(from_s * 1e9),
        to_ns=to_ns,
        cue=percept.label,
        ahead_m=ahead_m,
        left_m=left_m,
        range_m=percept.range_m,
        bearing_rad=percept.bearing_rad,
        sd_m=math.sqrt(there_m2 + here_m2),
        sd_rad=0.0,
        before_ns=before_ns,
        view=view + 1,
    )


def _seen_from_path(percept: Percept, graph: Graph) -> tuple[Percept, int]:
    """Return a percept as it is seen from the path's last place, and when the agent was there.

    It may have turned on the spot since then. Of several views of buildings that must agree, one
    may be wrong by that; of one alone, none, nor of points among which a robot turns by 50° within
    a place.
    """
    agent = graph.agent
    last = graph.last_segment
    assert agent is not None
    assert last is not None

    row = last.rows.numpy()[-1]
    step = relative(row[ODOMETRY], agent.odometry.pose())
    ahead_m = percept.range_m * math.cos(percept.bearing_rad)
    left_m = percept.range_m * math.sin(percept.bearing_rad)
    x_m, y_m = transform_from(step, np.array([ahead_m, left_m])).tolist()
    seen = msgspec.structs.replace(
        percept, range_m=math.hypot(x_m, y_m), bearing_rad=math.atan2(y_m, x_m)
    )
    return seen, round(float(row[STAMP]) * 1e9)


def _closure_by_range(percept: Percept, task: Task, landmark: Object) -> LoopClosure:
    """Make a closure by all the ranges to a landmark, from where it was heard first."""
    return LoopClosure(
        id=f"closure:{task.cycle}:{percept.label}",
        base_level=1.0,
        from_ns=max(0, landmark.created_ns),
        to_ns=task.stamp_ns,
        cue=percept.label,
        ahead_m=0.0,
        left_m=0.0,
        range_m=percept.range_m,
        bearing_rad=0.0,
        sd_m=percept.range_sd_m,
        sd_rad=0.0,
        range_alone=True,
    )
