"""The map correction codelet: a loop that closes corrects the path, and with it the map (paper §5.6, eq. 5-9).

It may take longer than a cycle. So it writes nothing that others write meanwhile: it leaves a `correction` node, whose
samples are (n, 7) rows of the path, stamp_s and the poses before and after, for the map shift codelet to carry out.
"""

from __future__ import annotations

import msgspec
import numpy as np
import numpy.typing as npt

from schemas.array import Array
from schemas.graph import Node, Operation
from schemas.mind import Replay, Task
from services.codelets.closures import holding
from services.codelets.least_squares import correct_headings
from services.codelets.path import POSE, STAMP, rows_of, steps_of
from services.codelets.pose_graph import Constraints, Floats, PoseGraph
from services.codelets.replay import close_loops
from services.codelets.revisits import KIND, constraints_of, found_again
from services.codelets.settings import Config
from services.codelets.sighted import Sightings

CORRECTION = "correction"
ROUNDS = 5


def correct_map(task: Task, config: Config) -> tuple[list[Operation], Replay | None]:
    """The closures that `task` makes and what becomes of those before, the correction of the path, and its replay."""
    rows = rows_of(task.nodes)
    before = [node for node in task.nodes if node.kind == KIND]
    closures = before + found_again(task, rows, config)
    if len(closures) == len(before):
        return [], None
    old = rows[:, POSE]
    loops = constraints_of(closures, rows)
    graph = PoseGraph(old, steps_of(rows, config), loops)
    holds = holding(graph, config.false_closure)
    judged = [_judged(node, bool(hold)) for node, hold in zip(closures, holds, strict=True)]
    written: list[Operation] = [
        node for node, was in zip(judged, [*before, *([None] * len(judged))], strict=False) if node != was
    ]
    held_before = {node.id for node in before if node.attributes["holds"]}
    held = {node.id for node in judged if node.attributes["holds"]}
    if held == held_before:
        return written, None
    seen = Sightings.of(task.nodes, rows[:, STAMP])
    new, replays = corrected(PoseGraph(graph.poses, graph.steps, loops.select(holds)), seen, config)
    samples = Array.of(np.column_stack([rows[:, STAMP], old, new]))
    written.append(Node(id=CORRECTION, kind=CORRECTION, base_level=1.0, samples=samples))
    replay = _replay(rows, new, loops.select(holds), config)
    replay.stamp_ns, replay.cycle, replay.replays = task.stamp_ns, task.cycle, replays
    replay.closed, replay.undone = sorted(held), sorted(held_before - held)
    return written, replay


def corrected(graph: PoseGraph, seen: Sightings, config: Config) -> tuple[Floats, int]:
    """(n, 3) poses with all loops closed, by the paper's rule or with the headings, and how often the path replayed.

    Where no loop is left, the path is as path integration has it. With the headings, the path is also bound to what was
    seen along it.
    """
    positions = close_loops(PoseGraph(graph.poses, _positions_only(graph), graph.closures))
    poses = np.column_stack([positions.positions_m, graph.poses[:, 2]])
    if config.correct == "positions":
        return poses, positions.replays
    poses = correct_headings(graph)
    landmarks_m = seen.landmarks_m(poses)
    for _ in range(ROUNDS if len(landmarks_m) else 0):
        joint = correct_headings(seen.joined(PoseGraph(poses, graph.steps, graph.closures), landmarks_m))
        poses, landmarks_m = joint[: len(poses)], joint[len(poses) :, :2]
    return poses, positions.replays


def _positions_only(graph: PoseGraph) -> Constraints:
    """The steps where headings are not corrected: what those are wrong by is left to the positions.

    A turn of variance h somewhere on a loop of length L moves its end by a variance of h L^2 / 3 on the mean.
    """
    steps, loops = graph.steps, graph.closures
    if not len(loops):
        return steps
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(steps.measured[:, 0], steps.measured[:, 1]))])
    lengths_m = np.abs(way_m[loops.second] - way_m[loops.first])
    variance = 1 / steps.information[:, 0, 0] + (lengths_m**2).mean() / 3 / steps.information[:, 2, 2]
    information = np.zeros_like(steps.information)
    information[:, 0, 0] = information[:, 1, 1] = 1 / variance
    information[:, 2, 2] = steps.information[:, 2, 2]
    return Constraints(steps.first, steps.second, steps.measured, information)


def _judged(node: Node, holds: bool) -> Node:
    return msgspec.structs.replace(node, attributes=node.attributes | {"holds": holds})


def _replay(rows: Floats, new: Floats, loops: Constraints, config: Config) -> Replay:
    """What is told of it, the newest place first, from where the loops begin."""
    first = int(min(loops.first.min(), loops.second.min())) if len(loops) else 0
    backwards = slice(None, first - 1 if first else None, -1)
    before, after = rows[backwards, POSE][:, :2], new[backwards, :2]
    pairs = _pairs(after, loops, len(rows), config)
    decay = config.synapse_decay_per_m
    strengths = [np.exp(-decay * np.hypot(*(where[pairs[:, 0]] - where[pairs[:, 1]]).T)) for where in (before, after)]
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


def _pairs(after: Floats, loops: Constraints, count: int, config: Config) -> npt.NDArray[np.int64]:
    """Place cells whose synapse changes most: those of one place, met on different ways; and neighbours on the way."""
    neighbours = np.column_stack([np.arange(len(after) - 1), np.arange(1, len(after))])
    ends = np.column_stack([count - 1 - loops.second, count - 1 - loops.first])
    reach = 1 / config.synapse_decay_per_m
    near = [
        (here, there)
        for one, there in ends.tolist()
        for here in np.flatnonzero(np.hypot(*(after - after[there]).T) < reach).tolist()
        if abs(here - one) < abs(here - there)
    ]
    pairs = np.vstack([neighbours, np.array(near, np.int64).reshape(-1, 2)])
    result: npt.NDArray[np.int64] = np.unique(pairs, axis=0)
    return result
