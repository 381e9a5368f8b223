"""The map correction codelet: a loop that closes corrects the path, and with it the map (paper
§5.6, eq. 5-9).

It may take longer than a cycle. So it writes nothing that others write meanwhile: it leaves a
Correction node for the apply-correction codelet.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.estimation.gnc import inliers
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pairwise_consistency import MIN_AGREEING, Views, consistent
from cogmap.estimation.pose_graph import (
    NO_CONSTRAINTS,
    Constraints,
    PoseGraph,
    diagonal_information,
    mahalanobis2,
    matvec,
    residuals,
)
from cogmap.estimation.reverse_replay import close_loops
from cogmap.geometry.arrays import Booleans, Floats
from cogmap.geometry.se2 import (
    cumulative,
    motion_onto,
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
    LoopClosure,
    Observations,
    PathSegment,
)
from cogmap.services.codelets.config import SECTION, Config
from cogmap.services.codelets.correction.joint import optimize_jointly
from cogmap.services.codelets.correction.synapses import replay_of
from cogmap.services.codelets.correction.waiting import may_wait
from cogmap.services.codelets.mapping.observations import Sightings
from cogmap.services.codelets.mapping.path import POSE, STAMP, joins_of, steps_of
from cogmap.services.codelets.mapping.views import constraints_of, views_of

MIN_ROWS = 10
IMPOSSIBLE_SD = 5.0
MAX_ROUNDS = 3
SAME_RAD = 0.05
SHORT_SEGMENTS = 8


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where closures of the present pass were not judged yet, and enough of it are there
    to agree; unless some were judged just now, a correction waits to be applied, or the path, part
    of which is sparse, explains them.
    """
    if CORRECTION_ID in graph.nodes:
        return []

    closures = list(graph.of_kind(LoopClosure))
    late = _late(closures, context.stamp_ns, config)
    fresh = [closure for closure in late if closure.accepted is None]
    if not fresh or len(late) < MIN_AGREEING:
        return []

    if context.stamp_ns < _next_judgement_ns(closures, graph.count(PathSegment), config):
        return []

    path = graph.path
    is_corrected = any(closure.accepted for closure in closures)
    is_long = any(segment.is_sparse for segment in path)
    if is_corrected and is_long and may_wait(fresh, rows_of(path), config):
        return []

    task = context.task(CODELET.name, about=[closure.id for closure in fresh])
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """What becomes of all closures, the correction of the path, and its replay."""
    rows = rows_of(graph.of_kind(PathSegment))
    closures = sorted(graph.of_kind(LoopClosure), key=lambda closure: closure.to_ns)
    if not closures or len(rows) < 2:
        return Answer()

    judgement = _judge(closures, graph.path, config)
    operations = _judged(closures, judgement)
    closed_before = {closure.id for closure in closures if closure.accepted}
    closed = set(_ids(closures, judgement.is_accepted))
    if closed == closed_before:
        return Answer(operations)

    seen = Sightings.of(graph.of_kind(Observations), rows[:, STAMP])
    poses, replays = corrected(judgement.path, seen, config)
    if config.anchor == "map":
        poses = _in_place(poses, judgement.path.poses, rows, closures)
    operations.append(_correction(rows, poses))

    loops = judgement.path.closures
    replay = msgspec.structs.replace(
        replay_of(rows, poses, loops, config.synapse_decay_per_m),
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
    reads=frozenset({PathSegment, Observations, LoopClosure}),
    writes=frozenset({LoopClosure, Correction}),
    config=Config,
    section=SECTION,
)


def _late(closures: list[LoopClosure], now_ns: int, config: Config) -> list[LoopClosure]:
    """The closures of the present pass."""
    since_ns = now_ns - config.revisit_s * 1e9
    return [closure for closure in closures if closure.to_ns > since_ns]


def _next_judgement_ns(closures: list[LoopClosure], segments: int, config: Config) -> float:
    """When closures may be judged again, by those judged so far; 0 where none was.

    Correcting a path of so many segments takes as long as it is, so it is done as much less often:
    it takes the same share of a long drive as of a short one.
    """
    judged_ns = [closure.to_ns for closure in closures if closure.accepted is not None]
    if not judged_ns:
        return 0.0

    spacing_s = config.closure_spacing_s * max(1.0, segments / SHORT_SEGMENTS)
    return max(judged_ns) + spacing_s * 1e9


class _Judgement(NamedTuple):
    """Which closures are consistent with one another (m,) and which are accepted (m,), and the path
    with those.
    """

    is_consistent: Booleans
    is_accepted: Booleans
    path: PoseGraph


def _judge(closures: list[LoopClosure], path: list[PathSegment], config: Config) -> _Judgement:
    """Which of the closures of a path are consistent, and of these accepted.

    Those that were consistent before the path became sparse are: others, with which they agreed,
    are no more.
    """
    rows = rows_of(path)
    steps = steps_of(rows, config)
    views = views_of(closures, rows)
    is_consistent = consistent(views, steps, config.false_closure)
    is_consistent &= views.j - views.i >= MIN_ROWS
    is_consistent |= _settled(closures, path)

    start = PoseGraph(
        poses=_start(rows[:, POSE], steps),
        steps=steps,
        closures=NO_CONSTRAINTS,
        joins=joins_of(path, rows[:, STAMP]),
    )
    corrected_path, holds = _accepted(start, views.select(is_consistent), config)

    is_accepted = np.zeros(len(closures), bool)
    is_accepted[is_consistent] = holds
    return _Judgement(is_consistent, is_accepted, corrected_path)


def _settled(closures: list[LoopClosure], path: list[PathSegment]) -> Booleans:
    """(m,): which closures are of the sparse part of the path, and were consistent."""
    sparse = [segment for segment in path if segment.is_sparse]
    if not sparse:
        return np.zeros(len(closures), bool)

    until_ns = sparse[-1].rows.numpy()[-1, STAMP] * 1e9
    settled = [bool(closure.consistent) and closure.to_ns <= until_ns for closure in closures]
    return np.array(settled)


def _start(poses: Floats, steps: Constraints) -> Floats:
    """(n, 3) poses to correct from: those believed, and where no step can have led from one to the
    next, those by path integration.

    Beliefs of an agent that was lost for a while would mislead the optimization for good.
    """
    measured = _possible_steps(poses, steps)
    heading_rad = poses[0, 2] + cumulative(measured[:, 2])

    turn = rotation_matrices(heading_rad[:-1])
    steps_m = matvec(turn, measured[:, :2])
    moved_m = cumulative(steps_m)

    positions_m = poses[0, :2] + moved_m
    return np.column_stack([positions_m, wrap_angle(heading_rad)])


def _possible_steps(poses: Floats, steps: Constraints) -> Floats:
    """(n - 1, 3): the steps between (n, 3) poses, where path integration makes them possible, and
    its own elsewhere.
    """
    believed = residuals(poses, steps)
    squared = mahalanobis2(believed, steps.information)
    is_possible = squared <= IMPOSSIBLE_SD**2

    deviation = np.where(is_possible[:, None], believed, 0.0)
    possible: Floats = steps.measurement + deviation
    return possible


def _accepted(start: PoseGraph, views: Views, config: Config) -> tuple[PoseGraph, Booleans]:
    """The path with the loops that are accepted, and which of `views` those are. It has none at the
    `start`.

    A landmark's constraint depends on the agent's heading: it is computed again where the
    optimization changes that.
    """
    loops = constraints_of(views, start.poses)
    for _ in range(MAX_ROUNDS):
        holds = inliers(start.with_closures(loops), config.false_closure)
        graph = start.with_closures(loops.select(holds))
        again = constraints_of(views, optimize(graph))

        if _turned_rad(loops, again) < SAME_RAD:
            break
        loops = again

    return graph, holds


def _turned_rad(before: Constraints, after: Constraints) -> float:
    """By how much any of the same constraints turned, at most."""
    before_rad = before.measurement[:, 2]
    after_rad = after.measurement[:, 2]

    change_rad = np.abs(wrap_angle(after_rad - before_rad))
    return float(change_rad.max(initial=0.0))


def corrected(graph: PoseGraph, seen: Sightings, config: Config) -> tuple[Floats, int]:
    """(n, 3) poses with all loops closed, by the paper's rule or with the headings, and how often
    the whole path was replayed for that: reverse replays of eq. 9, or solutions with the headings.

    Where no loop is left, the path is as path integration has it. With the headings, the path is
    also bound to what was seen along it.
    """
    if config.correct == "positions":
        found = close_loops(_positions_only(graph))
        headings_rad = graph.poses[:, 2]
        poses = np.column_stack([found.positions_m, headings_rad])
        return poses, found.replays

    return optimize_jointly(graph, seen, config)


def _in_place(poses: Floats, start: Floats, rows: Floats, closures: list[LoopClosure]) -> Floats:
    """(n, 3) corrected poses of path `rows`, moved as one to where the path was believed to be as
    far as earlier corrections reach; to where it was corrected from, its `start`, where none was.
    """
    corrected_until_ns = max((each.to_ns for each in closures if each.accepted), default=NEVER_NS)
    is_settled = rows[:, STAMP] * 1e9 <= corrected_until_ns
    before = rows[:, POSE]
    if not is_settled.any():
        is_settled[:] = True
        before = start

    motion = motion_onto(poses[is_settled, :2], before[is_settled, :2])
    positions_m = transform_from(motion, poses[:, :2])
    headings_rad = wrap_angle(poses[:, 2] + motion[2])
    return np.column_stack([positions_m, headings_rad])


def _positions_only(graph: PoseGraph) -> PoseGraph:
    """The path where headings are not corrected: the positions take up their errors.

    A turn of variance h somewhere on a loop of length L moves its end by a variance of h L^2 / 3 on
    the mean. Where a landmark is seen from, the headings of all the loop turn.
    """
    loops = graph.closures + graph.joins
    if not len(loops):
        return graph

    steps = _weakened_steps(graph.steps, loops)
    weights = _weights(graph.steps, loops)
    return PoseGraph(graph.poses, steps, loops.weighted(weights))


def _weakened_steps(steps: Constraints, loops: Constraints) -> Constraints:
    """The steps, whose positions take up what their turns move the ends of the loops by."""
    steps_m = np.hypot(*steps.measurement[:, :2].T)
    lengths_m = _between_ends(loops, steps_m)
    mean_m2 = (lengths_m**2).mean()

    by_heading_m2 = mean_m2 / 3 * steps.variance_rad2
    variance_m2 = steps.variance_m2 + by_heading_m2

    information = diagonal_information(
        position=1 / variance_m2,
        heading=steps.information[:, 2, 2],
    )
    return replace(steps, information=information)


def _weights(steps: Constraints, loops: Constraints) -> Floats:
    """(m,): the weights of loops whose lever arms turn with the headings along them."""
    loop_rad2 = _between_ends(loops, steps.variance_rad2)

    levers = loops.information[:, :2, 2]
    levers2 = (levers**2).sum(axis=1)
    added_share = levers2 / loops.information[:, 0, 0] * loop_rad2

    weights: Floats = 1 / (1 + added_share)
    return weights


def _between_ends(loops: Constraints, values: Floats) -> Floats:
    """(m,): the sum of (n,) values of the steps between the ends of each loop."""
    summed = cumulative(values)
    change = summed[loops.j] - summed[loops.i]
    return np.asarray(np.abs(change))


def _judged(closures: list[LoopClosure], judgement: _Judgement) -> list[Operation]:
    """The closures whose judgement differs from before."""
    is_consistent = judgement.is_consistent.tolist()
    is_accepted = judgement.is_accepted.tolist()

    changed: list[Operation] = []
    judgements = zip(closures, is_consistent, is_accepted, strict=True)
    for closure, consistent_now, accepted_now in judgements:
        judged = msgspec.structs.replace(
            closure,
            consistent=consistent_now,
            accepted=accepted_now,
        )
        if judged != closure:
            changed.append(judged)

    return changed


def _ids(closures: list[LoopClosure], is_chosen: Booleans) -> list[str]:
    """The ids of the chosen closures."""
    ids = []
    for closure, chosen in zip(closures, is_chosen.tolist(), strict=True):
        if chosen:
            ids.append(closure.id)

    return ids


def _correction(rows: Floats, poses: Floats) -> Correction:
    """The correction of path `rows` to (n, 3) `poses`, for the apply-correction codelet."""
    stamps_s = rows[:, STAMP]
    before = rows[:, POSE]
    corrections = np.column_stack([stamps_s, before, poses])

    return Correction(
        id=CORRECTION_ID,
        base_level=1.0,
        rows=Matrix.of(corrections),
    )
