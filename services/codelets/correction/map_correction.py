"""The map correction codelet: a loop that closes corrects the path, and with it the map (paper
§5.6, eq. 5-9).

It may take longer than a cycle. So it writes nothing that others write meanwhile: it leaves a
`correction` node, whose samples are (n, 7) rows of the path, stamp_s and the poses before and
after, for the map shift codelet to carry out.
"""

from __future__ import annotations

import msgspec
import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.geometry.se2 import rotation_matrices, wrap_angle
from schemas.array import Array
from schemas.cognition import Replay, Task
from schemas.graph import Node, Operation
from services.codelets.config import Config
from services.codelets.correction.gnc import inliers
from services.codelets.correction.least_squares import optimize
from services.codelets.correction.pairwise_consistency import Views, consistent
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    mahalanobis2,
    residuals,
)
from services.codelets.correction.reverse_replay import close_loops
from services.codelets.mapping.loop_detection import KIND, constraints_of, views_of
from services.codelets.mapping.observations import Sightings
from services.codelets.mapping.path import POSE, STAMP, rows_of, steps_of

CORRECTION = "correction"
LEAST_ROWS = 10
IMPOSSIBLE_SD = 5.0
MOST_ROUNDS = 3
SAME_RAD = 0.05
ROUNDS = 5


def correct_map(task: Task, config: Config) -> tuple[list[Operation], Replay | None]:
    """What becomes of the closures of `task`, those before and the new, the correction of the path,
    and its replay.
    """
    rows = rows_of(task.nodes)
    closures = sorted(
        (node for node in task.nodes if node.kind == KIND),
        key=lambda node: int(node.attributes["to_ns"]),
    )
    if not closures or len(rows) < 2:
        return [], None
    views = views_of(closures, rows)
    steps = steps_of(rows, config)
    agrees = consistent(views, steps, config.false_closure) & (views.j - views.i >= LEAST_ROWS)
    graph, among = _holding(_start(rows[:, POSE], steps), steps, views.select(agrees), config)
    holds = np.zeros(len(closures), bool)
    holds[agrees] = among
    written = _judged(closures, agrees, holds)
    held_before = {node.id for node in closures if node.attributes.get("holds")}
    held = {node.id for node, hold in zip(closures, holds, strict=True) if hold}
    if held == held_before:
        return written, None
    seen = Sightings.of(task.nodes, rows[:, STAMP])
    new, replays = corrected(graph, seen, config)
    samples = Array.of(np.column_stack([rows[:, STAMP], rows[:, POSE], new]))
    written.append(Node(id=CORRECTION, kind=CORRECTION, base_level=1.0, samples=samples))
    replay = _replay(rows, new, graph.closures, config)
    replay.stamp_ns = task.stamp_ns
    replay.cycle = task.cycle
    replay.replays = replays
    replay.closed, replay.undone = sorted(held), sorted(held_before - held)
    return written, replay


def _start(poses: Floats, steps: Constraints) -> Floats:
    """(n, 3) poses to correct from: those believed, but where no step could have led from one to
    the next.

    There the path goes on as it was felt. Who was lost for a while believed what would lead astray
    for good.
    """
    believed = residuals(poses, steps)
    possible = mahalanobis2(believed, steps.information) <= IMPOSSIBLE_SD**2
    measured = steps.measurement + np.where(possible[:, None], believed, 0.0)
    heading = poses[0, 2] + np.concatenate([[0.0], np.cumsum(measured[:, 2])])
    moved = np.einsum("mab,mb->ma", rotation_matrices(heading[:-1]), measured[:, :2])
    where = poses[0, :2] + np.vstack([np.zeros(2), np.cumsum(moved, axis=0)])
    return np.column_stack([where, wrap_angle(heading)])


def _holding(
    poses: Floats, steps: Constraints, views: Views, config: Config
) -> tuple[PoseGraph, Booleans]:
    """The path with the loops that hold, and which of `views` those are.

    What a landmark tells of where the agent stands is worked out again where its heading turns out
    to be another.
    """
    loops = constraints_of(views, poses)
    for _ in range(MOST_ROUNDS):
        holds = inliers(PoseGraph(poses, steps, loops), config.false_closure)
        graph = PoseGraph(poses, steps, loops.select(holds))
        again = constraints_of(views, optimize(graph))
        turned = np.abs(wrap_angle(again.measurement[:, 2] - loops.measurement[:, 2]))
        if turned.max(initial=0.0) < SAME_RAD:
            break
        loops = again
    return graph, holds


def corrected(graph: PoseGraph, seen: Sightings, config: Config) -> tuple[Floats, int]:
    """(n, 3) poses with all loops closed, by the paper's rule or with the headings, and how often
    the path replayed.

    Where no loop is left, the path is as path integration has it. With the headings, the path is
    also bound to what was seen along it.
    """
    positions = close_loops(_positions_only(graph))
    poses = np.column_stack([positions.positions_m, graph.poses[:, 2]])
    if config.correct == "positions":
        return poses, positions.replays
    poses = optimize(graph)
    landmarks_m = seen.landmarks_m(poses)
    for _ in range(ROUNDS if len(landmarks_m) else 0):
        joint = optimize(seen.joined(PoseGraph(poses, graph.steps, graph.closures), landmarks_m))
        poses, landmarks_m = joint[: len(poses)], joint[len(poses) :, :2]
    return poses, positions.replays


def _positions_only(graph: PoseGraph) -> PoseGraph:
    """The path where headings are not corrected: what those are wrong by is left to the positions.

    A turn of variance h somewhere on a loop of length L moves its end by a variance of h L^2 / 3 on
    the mean. Where a landmark is seen from, the headings of all the loop turn.
    """
    steps = graph.steps
    loops = graph.closures
    if not len(loops):
        return graph
    way_m = np.concatenate(
        [[0.0], np.cumsum(np.hypot(steps.measurement[:, 0], steps.measurement[:, 1]))]
    )
    lengths_m = np.abs(way_m[loops.j] - way_m[loops.i])
    turning = 1 / steps.information[:, 2, 2]
    variance = 1 / steps.information[:, 0, 0] + (lengths_m**2).mean() / 3 * turning
    information = np.zeros_like(steps.information)
    information[:, 0, 0] = information[:, 1, 1] = 1 / variance
    information[:, 2, 2] = steps.information[:, 2, 2]
    turned = np.concatenate([[0.0], np.cumsum(turning)])
    levers = loops.information[:, :2, 2]
    unsure = (
        (levers**2).sum(axis=1)
        / loops.information[:, 0, 0]
        * np.abs(turned[loops.j] - turned[loops.i])
    )
    steps = Constraints(steps.i, steps.j, steps.measurement, information)
    return PoseGraph(graph.poses, steps, loops.weighted(1 / (1 + unsure)))


def _judged(closures: list[Node], agrees: Booleans, holds: Booleans) -> list[Operation]:
    """The closures of which something else is to be said than before."""
    said = [
        msgspec.structs.replace(node, attributes=node.attributes | {"agrees": agree, "holds": hold})
        for node, agree, hold in zip(closures, agrees.tolist(), holds.tolist(), strict=True)
    ]
    return [node for node, was in zip(said, closures, strict=True) if node != was]


def _replay(rows: Floats, new: Floats, loops: Constraints, config: Config) -> Replay:
    """What is told of it, the newest place first, from where the loops begin."""
    first = int(min(loops.i.min(), loops.j.min())) if len(loops) else 0
    backwards = slice(None, first - 1 if first else None, -1)
    before = rows[backwards, POSE][:, :2]
    after = new[backwards, :2]
    pairs = _pairs(after, loops, len(rows), config)
    decay = config.synapse_decay_per_m
    strengths = [
        np.exp(-decay * np.hypot(*(where[pairs[:, 0]] - where[pairs[:, 1]]).T))
        for where in (before, after)
    ]
    return Replay(
        cycle=0,
        replays=0,
        closed=[],
        undone=[],
        stamps_ns=Array.of(np.rint(rows[backwards, STAMP] * 1e9).astype(np.int64)),
        positions_m=Array.of(before),
        shifts_m=Array.of(after - before),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(strengths[1] - strengths[0]),
        decay_per_m=decay,
    )


def _pairs(after: Floats, loops: Constraints, count: int, config: Config) -> Indices:
    """Place cells whose synapse changes most: those of one place, met on different ways; and
    neighbours on the way.
    """
    neighbours = np.column_stack([np.arange(len(after) - 1), np.arange(1, len(after))])
    ends = np.column_stack([count - 1 - loops.j, count - 1 - loops.i])
    reach = 1 / config.synapse_decay_per_m
    near = [
        (here, there)
        for one, there in ends.tolist()
        for here in np.flatnonzero(np.hypot(*(after - after[there]).T) < reach).tolist()
        if abs(here - one) < abs(here - there)
    ]
    pairs = np.vstack([neighbours, np.array(near, np.int64).reshape(-1, 2)])
    result: Indices = np.unique(pairs, axis=0)
    return result
