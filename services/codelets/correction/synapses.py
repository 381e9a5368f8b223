"""What a correction predicts of place cells: their fields shift, and their synapses change (paper
§5.6).
"""

from __future__ import annotations

import numpy as np

from cogmap.estimation.pose_graph import Constraints
from cogmap.geometry.arrays import Floats, Indices
from cogmap.schemas.array import Array
from cogmap.schemas.cognition import Replay
from cogmap.services.codelets.mapping.path import POSE, STAMP

# How fast the synapse between two place cells decays with the distance of their fields: k of
# S = exp(-k d), for which the paper has no value.
DECAY_PER_M = 0.2


def replay_of(rows: Floats, poses: Floats, loops: Constraints) -> Replay:
    """Make the replay of a correction of path `rows` to (n, 3) `poses`: the newest place first, to
    where the loops begin. It is of no cycle yet, and names no closures.
    """
    first = int(min(loops.i.min(), loops.j.min())) if len(loops) else 0
    before = rows[first:][::-1]
    before_m = before[:, POSE][:, :2]
    after_m = poses[first:][::-1, :2]

    # Place cells whose synapse changes most, numbered from the newest place on: neighbours along
    # the path, and those of one place on different passes.
    cells = np.arange(len(after_m))
    changing = [np.column_stack([cells[:-1], cells[1:]])]
    newest = len(rows) - 1
    for i, j in zip(loops.i.tolist(), loops.j.tolist(), strict=True):
        newer, older = newest - j, newest - i
        distance_m = np.hypot(*(after_m - after_m[older]).T)
        near = np.flatnonzero(distance_m < 1 / DECAY_PER_M)
        of_newer_pass = near[np.abs(near - newer) < np.abs(near - older)]
        changing.append(np.column_stack([of_newer_pass, np.full(len(of_newer_pass), older)]))

    stamps_ns = np.rint(before[:, STAMP] * 1e9)
    pairs = np.unique(np.vstack(changing), axis=0)
    strengths_before = _strengths(before_m, pairs)
    strengths_after = _strengths(after_m, pairs)
    return Replay(
        cycle=0,
        replays=0,
        closed=[],
        undone=[],
        stamps_ns=Array.of(stamps_ns.astype(np.int64)),
        positions_m=Array.of(before_m),
        shifts_m=Array.of(after_m - before_m),
        pairs=Array.of(pairs.astype(np.int32)),
        strength_changes=Array.of(strengths_after - strengths_before),
        decay_per_m=DECAY_PER_M,
    )


def _strengths(positions_m: Floats, pairs: Indices) -> Floats:
    """Compute the synaptic strengths of pairs of place cells, (m,)."""
    apart_m = positions_m[pairs[:, 0]] - positions_m[pairs[:, 1]]
    strengths: Floats = np.exp(-DECAY_PER_M * np.hypot(*apart_m.T))
    return strengths
