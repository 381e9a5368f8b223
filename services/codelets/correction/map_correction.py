"""The map correction codelet: a loop that closes, or a landmark that comes again, corrects the
path, and with it the map (paper §5.6, eq. 5-9).

Beyond the paper, landmarks that are points correct it as it grows, whether a loop closes or not:
what is believed now is then as good as what will be believed of it later, nearly.

It may take longer than a cycle. So it writes nothing that others write meanwhile: it leaves a
Correction node for the apply-correction codelet.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.estimation import printed_rule
from cogmap.estimation.alignment import motion_onto
from cogmap.estimation.gnc import RELIABLE_SHARE, inliers
from cogmap.estimation.hypotheses import Hypotheses
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pairwise_consistency import (
    MAX_VIEW_SD_M,
    Views,
    consistent,
)
from cogmap.estimation.pose_graph import (
    NO_CONSTRAINTS,
    Constraints,
    PoseGraph,
    mahalanobis2,
    matvec,
    residuals,
)
from cogmap.estimation.reverse_replay import close_loops, with_positions_only
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import (
    cumulative,
    integrate,
    rotate,
    rotation_matrices,
    transform_from,
    wrap_angle,
)
from cogmap.graph.graph import Graph
from cogmap.graph.path import rows_of
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.schemas.array import Matrix
from cogmap.schemas.codelets import Task
from cogmap.schemas.graph import Operation, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    NEVER_NS,
    Correction,
    LinkKind,
    LoopClosure,
    Object,
    Observations,
    PathSegment,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.correction.due import (
    FALSE_CLOSURE,
    GROWN_PLACES,
    MIN_ROWS,
    closures_due,
    grown_segment,
    is_bound_by_points,
)
from cogmap.services.codelets.correction.joint import optimize_jointly
from cogmap.services.codelets.correction.synapses import replay_of
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import (
    POSE,
    STAMP,
    joins_of,
    steps_of,
)
from cogmap.services.codelets.mapping.ranges import Ranges
from cogmap.services.codelets.mapping.views import constraints_of, views_of

# In standard deviations of a pose: of true steps one in 65,000 errs by more.
IMPOSSIBLE_SD = 5.0
# At most so many times constraints are computed anew, until headings turn by less (3 degrees).
MAX_ROUNDS = 3
SAME_RAD = 0.05


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """Return one task about the closures that are to be judged, or else about the path's last
    segment, if the points seen along the path bind it and it has grown; none while a correction
    waits to be applied.
    """
    if CORRECTION_ID in graph.nodes:
        return []

    about = [closure.id for closure in closures_due(context, graph, config)]
    if not about and config.landmarks == "points":
        grown = grown_segment(context, graph)
        about = grown if grown and is_bound_by_points(graph, config) else []
    return [context.task(CODELET.name, about)] if about else []


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """Return what becomes of all closures, the correction of the path, and its replay."""
    rows = rows_of(graph.of_kind(PathSegment))
    closures = sorted(graph.of_kind(LoopClosure), key=lambda closure: closure.to_ns)
    is_bound = is_bound_by_points(graph, config)
    if len(rows) < 2 or not (closures or is_bound):
        return Answer()

    judgement = _judge(closures, graph.path, config)
    operations: list[Operation] = []
    closed = set()
    is_consistent = judgement.is_consistent.tolist()
    is_accepted = judgement.is_accepted.tolist()
    for closure, agrees, holds in zip(closures, is_consistent, is_accepted, strict=True):
        if holds:
            closed.add(closure.id)
        if (closure.consistent, closure.accepted) != (agrees, holds):
            judged = msgspec.structs.replace(closure, consistent=agrees, accepted=holds)
            operations.append(judged)

    # Landmarks too uncertain for their closures to agree, as far buildings seen by cameras, bind
    # the path by their sightings alone when they come again.
    closed_before = {closure.id for closure in closures if closure.accepted}
    fresh = [closure for closure in closures if closure.accepted is None]
    binds = any(closure.sd_m > MAX_VIEW_SD_M for closure in fresh)
    binds_anew = is_bound or (binds and config.correct == "heading")
    if closed == closed_before and not binds_anew:
        return Answer(operations)

    # Perception knows the sizes of buildings that it has names for.
    sized = {node.label for node in graph.of_kind(Object) if node.look}
    observed = Sightings.of(graph.of_kind(Observations), rows[:, STAMP])
    seen = observed.of_known_extent(sized)
    heard = Ranges.of(graph.of_kind(Observations), rows[:, STAMP])
    if config.correct == "eq9":
        poses, replays = shifted(rows, judgement, config)
    else:
        poses, replays = corrected(judgement.path, seen, heard, config)
    if config.anchor == "map":
        # Moved as one to where the path was believed to be as far as earlier corrections reach;
        # without any, to where it was corrected from.
        corrected_until_ns = max(
            (each.to_ns for each in closures if each.accepted), default=NEVER_NS
        )
        is_settled = rows[:, STAMP] * 1e9 <= corrected_until_ns
        if is_bound:
            is_settled[:-GROWN_PLACES] = True
        before = rows[:, POSE]
        if not is_settled.any():
            is_settled[:] = True
            before = judgement.path.poses

        motion = motion_onto(poses[is_settled, :2], before[is_settled, :2])
        positions_m = transform_from(motion, poses[:, :2])
        poses = np.column_stack([positions_m, wrap_angle(poses[:, 2] + motion[2])])

    moved = np.column_stack([rows[:, STAMP], rows[:, POSE], poses])
    operations.append(Correction(id=CORRECTION_ID, base_level=1.0, rows=Matrix.of(moved)))
    replay = msgspec.structs.replace(
        replay_of(rows, poses, judgement.path.closures),
        stamp_ns=task.stamp_ns,
        cycle=task.cycle,
        replays=replays,
        closed=sorted(closed),
        undone=sorted(closed_before - closed),
    )
    return Answer(operations, events=[replay])


CODELET = Codelet(
    name="map_correction",
    phase=Phase.BACKGROUND,
    due=due,
    run=run,
    reads=frozenset({PathSegment, Observations, LoopClosure, Object, LinkKind.ALONG}),
    writes=frozenset({LoopClosure, Correction}),
    config=Config,
    section=SECTION,
)


class Judgement(NamedTuple):
    """Which closures are consistent with one another (m,) and which are accepted (m,), and the path
    with those, which are also given as views.
    """

    is_consistent: Booleans
    is_accepted: Booleans
    path: PoseGraph
    accepted: Views


def _judge(closures: list[LoopClosure], path: list[PathSegment], config: Config) -> Judgement:
    """Return which of the closures of a path are consistent, and of these accepted. Those by range
    alone are always: the ranges are weighed one by one as the path is corrected. All are if one
    sighting closes a loop.
    """
    rows = rows_of(path)
    steps = steps_of(rows, config)
    is_view = np.array([not each.range_alone for each in closures], bool)
    views = views_of([each for each in closures if not each.range_alone], rows)
    believes_all = config.closes_by == "sighting"
    is_consistent = np.ones(len(views.i), bool)
    if closures and not believes_all:
        is_consistent = consistent(views, steps, FALSE_CLOSURE)
    is_consistent &= views.j - views.i >= MIN_ROWS

    # Closures of the sparse part of the path that were consistent stay so: those that they agreed
    # with are no more.
    sparse = [segment for segment in path if segment.is_sparse]
    if sparse:
        until_ns = sparse[-1].rows.numpy()[-1, STAMP] * 1e9
        settled = [bool(each.consistent) and each.to_ns <= until_ns for each in closures]
        is_consistent |= np.array(settled, bool)[is_view]

    start = PoseGraph(
        poses=_start(rows[:, POSE], steps),
        steps=steps,
        closures=NO_CONSTRAINTS,
        joins=joins_of(path, rows[:, STAMP]),
    )
    chosen = views.select(is_consistent)
    loops = _loops(start, chosen, believes_all)
    if len(loops.holds) and loops.holds.mean() < RELIABLE_SHARE:
        # A loop that was closed by landmarks alone may have turned the path too far for views of
        # places to turn it back: it is judged by self-motion alone, too.
        poses = integrate(rows[0, POSE], steps.measurement)
        poses[:, 2] = wrap_angle(poses[:, 2])
        alone = replace(start, poses=poses)
        loops = min(
            loops, _loops(alone, chosen, believes_all), key=lambda each: each.truncated_cost
        )

    agrees = np.ones(len(closures), bool)
    agrees[is_view] = is_consistent
    is_accepted = agrees.copy()
    is_accepted[is_view & agrees] = loops.holds
    return Judgement(agrees, is_accepted, loops.path, chosen.select(loops.holds))


class _Loops(NamedTuple):
    """Which closures of `judged` hold, (m,), and the path with those."""

    judged: PoseGraph
    holds: Booleans
    path: PoseGraph

    @property
    def truncated_cost(self) -> float:
        """Return the cost of holding these alone."""
        return Hypotheses(self.judged, FALSE_CLOSURE).truncated_cost(self.holds)


def _loops(start: PoseGraph, chosen: Views, believes_all: bool) -> _Loops:
    """Judge consistent closures from where the path is at the `start`, or believe all of them.

    A landmark's constraint depends on the agent's heading: it is computed again if the optimization
    changes that.
    """
    loops = constraints_of(chosen, start.poses)
    for _ in range(MAX_ROUNDS):
        judged = start.with_closures(loops)
        holds = np.ones(len(loops), bool)
        if not believes_all:
            holds = inliers(judged, FALSE_CLOSURE)
        graph = start.with_closures(loops.select(holds))
        again = constraints_of(chosen, optimize(graph))

        turned_rad = np.abs(wrap_angle(again.measurement[:, 2] - loops.measurement[:, 2]))
        if turned_rad.max(initial=0.0) < SAME_RAD:
            break
        loops = again

    return _Loops(judged, holds, graph)


def _start(poses: Floats, steps: Constraints) -> Floats:
    """Return the (n, 3) poses to correct from: those believed, but path integration's own for steps
    that it makes impossible. Beliefs of an agent that was lost for a while would mislead the
    optimization for good.
    """
    believed = residuals(poses, steps)
    is_possible = mahalanobis2(believed, steps.information) <= IMPOSSIBLE_SD**2
    measured = steps.measurement + np.where(is_possible[:, None], believed, 0.0)
    heading_rad = poses[0, 2] + cumulative(measured[:, 2])

    turn = rotation_matrices(heading_rad[:-1])
    moved_m = cumulative(matvec(turn, measured[:, :2]))
    return np.column_stack([poses[0, :2] + moved_m, wrap_angle(heading_rad)])


def shifted(rows: Floats, judgement: Judgement, config: Config) -> tuple[Floats, int]:
    """Close the accepted loops of the path `rows`, as it is believed, by eq. 9 as it is printed.
    Return the (n, 3) poses, whose headings stay, and how often the path was replayed.
    """
    poses = rows[:, POSE]
    views = judgement.accepted
    there_m = rotate(views.there_m, poses[views.i, 2])
    here_m = rotate(views.here_m, poses[views.j, 2])
    loops = printed_rule.Loops(views.i, views.j, here_m - there_m, views.sd_m**2)

    step_m2 = steps_of(rows, config).variance_m2
    positions_m, replays = printed_rule.close_loops(poses[:, :2], loops, step_m2)
    return np.column_stack([positions_m, poses[:, 2]]), replays


def corrected(
    graph: PoseGraph, seen: Sightings, heard: Ranges, config: Config
) -> tuple[Floats, int]:
    """Close all loops, by reverse replay or with the headings. Return the (n, 3) poses, and how
    often the whole path was replayed for that: reverse replays of eq. 9, or solutions with the
    headings.

    Without loops, the path is as path integration has it. With the headings, the path is also bound
    to what was seen along it.
    """
    if config.correct == "positions":
        found = close_loops(with_positions_only(graph))
        return np.column_stack([found.positions_m, graph.poses[:, 2]]), found.replays

    return optimize_jointly(graph, seen, heard, config)
