"""The map correction codelet: a loop that closes corrects the path, and with it the map (paper
§5.6, eq. 5-9).

It may take longer than a cycle. So it writes nothing that others write meanwhile: it leaves a
Correction node for the apply-correction codelet.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices, wrap_angle
from cogmap.graph.graph import Graph
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from schemas.array import Array, Matrix
from schemas.codelets import Task
from schemas.cognition import Replay
from schemas.graph import Operation, Phase
from schemas.nodes import CORRECTION_ID, Correction, LoopClosure, Observations, PathSegment
from services.codelets.config import SECTION, Config
from services.codelets.correction.gnc import inliers
from services.codelets.correction.joint import optimize_jointly
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pairwise_consistency import MIN_AGREEING, Views, consistent
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    mahalanobis2,
    residuals,
)
from services.codelets.correction.reverse_replay import close_loops
from services.codelets.mapping.loop_detection import constraints_of, views_of
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import POSE, STAMP, rows_of, steps_of

MIN_ROWS = 10
IMPOSSIBLE_SD = 5.0
MAX_ROUNDS = 3
SAME_RAD = 0.05


def due(context: CycleContext, graph: Graph, config: Config) -> list[Task]:
    """One task where there are closures not judged yet, and enough of late to agree; unless some
    were judged just now, or a correction waits to be applied.
    """
    if CORRECTION_ID in graph.nodes:
        return []

    closures = list(graph.of_kind(LoopClosure))
    fresh = [closure.id for closure in closures if closure.accepted is None]
    late_ns = context.stamp_ns - config.revisit_s * 1e9
    late = [closure for closure in closures if closure.to_ns > late_ns]
    if not fresh or len(late) < MIN_AGREEING:
        return []

    judged_ns = [closure.to_ns for closure in closures if closure.accepted is not None]
    if judged_ns:
        next_ns = max(judged_ns) + config.closure_spacing_s * 1e9
        if context.stamp_ns < next_ns:
            return []

    task = context.task(CODELET.name, about=fresh)
    return [task]


def run(task: Task, graph: Graph, config: Config) -> Answer:
    """What becomes of all closures, the correction of the path, and its replay."""
    rows = rows_of(graph.of_kind(PathSegment))
    closures = sorted(graph.of_kind(LoopClosure), key=lambda closure: closure.to_ns)
    if not closures or len(rows) < 2:
        return Answer()

    views = views_of(closures, rows)
    steps = steps_of(rows, config)
    is_consistent = consistent(views, steps, config.false_closure)
    is_consistent &= views.j - views.i >= MIN_ROWS

    start = _start(rows[:, POSE], steps)
    path, accepted = _accepted(start, steps, views.select(is_consistent), config)
    is_accepted = np.zeros(len(closures), bool)
    is_accepted[is_consistent] = accepted

    operations = _judged(closures, is_consistent, is_accepted)
    accepted_before = {closure.id for closure in closures if closure.accepted}
    accepted_now = set()
    for closure, holds in zip(closures, is_accepted.tolist(), strict=True):
        if holds:
            accepted_now.add(closure.id)

    if accepted_now == accepted_before:
        return Answer(operations)

    seen = Sightings.of(graph.of_kind(Observations), rows[:, STAMP])
    poses, replays = corrected(path, seen, config)
    correction = np.column_stack([rows[:, STAMP], rows[:, POSE], poses])
    operations.append(Correction(id=CORRECTION_ID, base_level=1.0, rows=Matrix.of(correction)))

    replay = msgspec.structs.replace(
        _replay(rows, poses, path.closures, config),
        stamp_ns=task.stamp_ns,
        cycle=task.cycle,
        replays=replays,
        closed=sorted(accepted_now),
        undone=sorted(accepted_before - accepted_now),
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


def _start(poses: Floats, steps: Constraints) -> Floats:
    """(n, 3) poses to correct from: those believed, and where no step can have led from one to the
    next, those by path integration.

    Beliefs of an agent that was lost for a while would mislead the optimization for good.
    """
    believed = residuals(poses, steps)
    is_possible = mahalanobis2(believed, steps.information) <= IMPOSSIBLE_SD**2
    measured = steps.measurement + np.where(is_possible[:, None], believed, 0.0)

    turned_rad = np.concatenate([[0.0], np.cumsum(measured[:, 2])])
    heading_rad = poses[0, 2] + turned_rad
    turn = rotation_matrices(heading_rad[:-1])
    steps_m = np.einsum("mab,mb->ma", turn, measured[:, :2])

    moved_m = np.vstack([np.zeros(2), np.cumsum(steps_m, axis=0)])
    positions_m = poses[0, :2] + moved_m
    return np.column_stack([positions_m, wrap_angle(heading_rad)])


def _accepted(
    poses: Floats, steps: Constraints, views: Views, config: Config
) -> tuple[PoseGraph, Booleans]:
    """The path with the loops that are accepted, and which of `views` those are.

    A landmark's constraint depends on the agent's heading: it is computed again where the
    optimization changes that.
    """
    loops = constraints_of(views, poses)
    for _ in range(MAX_ROUNDS):
        holds = inliers(PoseGraph(poses, steps, loops), config.false_closure)
        graph = PoseGraph(poses, steps, loops.select(holds))
        again = constraints_of(views, optimize(graph))

        turned_rad = again.measurement[:, 2] - loops.measurement[:, 2]
        change_rad = np.abs(wrap_angle(turned_rad))
        if change_rad.max(initial=0.0) < SAME_RAD:
            break
        loops = again

    return graph, holds


def corrected(graph: PoseGraph, seen: Sightings, config: Config) -> tuple[Floats, int]:
    """(n, 3) poses with all loops closed, by the paper's rule or with the headings, and how often
    the whole path was replayed for that: reverse replays of eq. 9, or solutions with the headings.

    Where no loop is left, the path is as path integration has it. With the headings, the path is
    also bound to what was seen along it.
    """
    if config.correct == "positions":
        positions = close_loops(_positions_only(graph))
        poses = np.column_stack([positions.positions_m, graph.poses[:, 2]])
        return poses, positions.replays

    return optimize_jointly(graph, seen, config)


def _positions_only(graph: PoseGraph) -> PoseGraph:
    """The path where headings are not corrected: the positions take up their errors.

    A turn of variance h somewhere on a loop of length L moves its end by a variance of h L^2 / 3 on
    the mean. Where a landmark is seen from, the headings of all the loop turn.
    """
    steps = graph.steps
    loops = graph.closures
    if not len(loops):
        return graph

    steps_m = np.hypot(steps.measurement[:, 0], steps.measurement[:, 1])
    distance_m = _cumulative(steps_m)
    lengths_m = np.abs(distance_m[loops.j] - distance_m[loops.i])

    heading_variance = 1 / steps.information[:, 2, 2]
    by_heading_m2 = (lengths_m**2).mean() / 3 * heading_variance
    variance_m2 = 1 / steps.information[:, 0, 0] + by_heading_m2
    information = np.zeros_like(steps.information)
    information[:, 0, 0] = 1 / variance_m2
    information[:, 1, 1] = 1 / variance_m2
    information[:, 2, 2] = steps.information[:, 2, 2]
    weakened = Constraints(steps.i, steps.j, steps.measurement, information)

    turned = _cumulative(heading_variance)
    loop_variance = np.abs(turned[loops.j] - turned[loops.i])
    levers = loops.information[:, :2, 2]
    levers2 = (levers**2).sum(axis=1)
    added_share = levers2 / loops.information[:, 0, 0] * loop_variance
    weights = 1 / (1 + added_share)
    return PoseGraph(graph.poses, weakened, loops.weighted(weights))


def _cumulative(values: Floats) -> Floats:
    """(n + 1,): the sum of the first 0 to n of (n,) values."""
    return np.concatenate([[0.0], np.cumsum(values)])


def _judged(
    closures: list[LoopClosure], is_consistent: Booleans, is_accepted: Booleans
) -> list[Operation]:
    """The closures whose judgement differs from before."""
    changed: list[Operation] = []
    judgements = zip(closures, is_consistent.tolist(), is_accepted.tolist(), strict=True)
    for closure, consistent_now, accepted_now in judgements:
        judged = msgspec.structs.replace(closure, consistent=consistent_now, accepted=accepted_now)
        if judged != closure:
            changed.append(judged)

    return changed


def _replay(rows: Floats, new: Floats, loops: Constraints, config: Config) -> Replay:
    """The replay of a correction, the newest place first, from where the loops begin."""
    first = int(min(loops.i.min(), loops.j.min())) if len(loops) else 0
    backwards = slice(None, first - 1 if first else None, -1)
    before_m = rows[backwards, POSE][:, :2]
    after_m = new[backwards, :2]
    stamps_ns = np.rint(rows[backwards, STAMP] * 1e9).astype(np.int64)

    pairs = _pairs(after_m, loops, len(rows), config)
    decay_per_m = config.synapse_decay_per_m
    strength = _strengths(after_m, pairs, decay_per_m)
    change = strength - _strengths(before_m, pairs, decay_per_m)
    return Replay(
        cycle=0,
        replays=0,
        closed=[],
        undone=[],
        stamps_ns=Array.of(stamps_ns),
        positions_m=Array.of(before_m),
        shifts_m=Array.of(after_m - before_m),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(change),
        decay_per_m=decay_per_m,
    )


def _strengths(positions_m: Floats, pairs: Indices, decay_per_m: float) -> Floats:
    """(m,): the synaptic strengths of pairs of place cells (paper §5.6)."""
    first_m = positions_m[pairs[:, 0]]
    second_m = positions_m[pairs[:, 1]]
    apart_m = first_m - second_m

    distance_m = np.hypot(apart_m[:, 0], apart_m[:, 1])
    strengths: Floats = np.exp(-decay_per_m * distance_m)
    return strengths


def _pairs(after: Floats, loops: Constraints, count: int, config: Config) -> Indices:
    """(m, 2): place cells whose synapse changes most, those of one place on different passes, and
    neighbours along the path.
    """
    order = np.arange(len(after))
    neighbours = np.column_stack([order[:-1], order[1:]])
    ends = np.column_stack([count - 1 - loops.j, count - 1 - loops.i])
    reach_m = 1 / config.synapse_decay_per_m

    near = []
    for newer, older in ends.tolist():
        distance_m = np.hypot(*(after - after[older]).T)
        for cell in np.flatnonzero(distance_m < reach_m).tolist():
            is_of_newer_pass = abs(cell - newer) < abs(cell - older)
            if is_of_newer_pass:
                near.append((cell, older))

    crossings = np.array(near, np.int64).reshape(-1, 2)
    pairs = np.vstack([neighbours, crossings])
    result: Indices = np.unique(pairs, axis=0)
    return result
