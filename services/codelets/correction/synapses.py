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


def replay_of(rows: Floats, poses: Floats, loops: Constraints, decay_per_m: float) -> Replay:
    """The replay of a correction of path `rows` to (n, 3) `poses`: the newest place first, to where
    the loops begin. It is of no cycle yet, and names no closures.
    """
    first = _first_place(loops)
    before = rows[first:][::-1]
    before_m = before[:, POSE][:, :2]
    after_m = poses[first:][::-1, :2]

    stamps_ns = np.rint(before[:, STAMP] * 1e9)
    pairs = _pairs(after_m, loops, len(rows), 1 / decay_per_m)
    strengths_before = _strengths(before_m, pairs, decay_per_m)
    strengths_after = _strengths(after_m, pairs, decay_per_m)
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
        decay_per_m=decay_per_m,
    )


def _first_place(loops: Constraints) -> int:
    """The first place of the path that a loop joins; 0 where there is no loop."""
    if not len(loops):
        return 0

    places = np.concatenate([loops.i, loops.j])
    return int(places.min())


def _strengths(positions_m: Floats, pairs: Indices, decay_per_m: float) -> Floats:
    """(m,): the synaptic strengths of pairs of place cells."""
    distance_m = _distances_m(positions_m, pairs)
    strengths: Floats = np.exp(-decay_per_m * distance_m)
    return strengths


def _distances_m(positions_m: Floats, pairs: Indices) -> Floats:
    """(m,): how far the two of each pair are from one another."""
    first_m = positions_m[pairs[:, 0]]
    second_m = positions_m[pairs[:, 1]]

    apart_m = first_m - second_m
    return np.asarray(np.hypot(*apart_m.T))


def _pairs(fields_m: Floats, loops: Constraints, places: int, reach_m: float) -> Indices:
    """(m, 2): place cells whose synapse changes most, those of one place on different passes, and
    neighbours along the path.

    Cells are numbered from the newest of the path's `places` on.
    """
    newest = places - 1
    ends = np.column_stack([newest - loops.j, newest - loops.i])

    neighbours = _neighbours(len(fields_m))
    crossings = _crossings(fields_m, ends, reach_m)
    pairs: Indices = np.unique(np.vstack([neighbours, crossings]), axis=0)
    return pairs


def _neighbours(count: int) -> Indices:
    """(count - 1, 2): each cell and the next."""
    cells = np.arange(count)
    return np.column_stack([cells[:-1], cells[1:]])


def _crossings(fields_m: Floats, ends: Indices, reach_m: float) -> Indices:
    """(k, 2): cells of one place on different passes, by the (m, 2) cells that loops join."""
    crossings = []
    for newer, older in ends.tolist():
        for cell in _same_place(fields_m, newer, older, reach_m):
            crossings.append((cell, older))

    return np.array(crossings, np.int64).reshape(-1, 2)


def _same_place(fields_m: Floats, newer: int, older: int, reach_m: float) -> list[int]:
    """The cells of the newer pass within reach of the place cell `older`."""
    apart_m = fields_m - fields_m[older]
    distance_m = np.hypot(*apart_m.T)

    near = []
    for cell in np.flatnonzero(distance_m < reach_m).tolist():
        is_of_newer_pass = abs(cell - newer) < abs(cell - older)
        if is_of_newer_pass:
            near.append(cell)

    return near
