"""Poses at the least cost whatever the number of full turns along the loops (beyond the paper).

A heading that has drifted by half a turn along a loop is as near to one full turn too many as to
none. Least squares stays with the number of turns that it starts from, so the others are tried
(Carlone and Censor 2014, doi 10.1109/TRO.2014.2347912, on cycles and the integer lattice).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import PoseGraph, cost, matvec, residuals
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import FULL_TURN_RAD, cumulative, rotation_matrices, wrap_angle

# Loops that are tried at most, and how often all of them: a bound on the time.
MAX_LOOPS = 4
MAX_ROUNDS = 3
# Between the ends of two loops a heading may err by a full turn from so many standard deviations
# on: such loops are wound independently.
INDEPENDENT_SD = 5.0
Loop = tuple[int, int]


def optimize_windings(graph: PoseGraph) -> Floats:
    """Find poses (n, 3) at a minimum of eq. 7, as `optimize` does, and at a lesser one if a loop
    with a full turn more or less has that. The first pose stays.
    """
    poses = optimize(graph)
    least = cost(poses, graph.constraints)
    variance_rad2 = cumulative(graph.steps.variance_rad2)
    loops = _independent(graph, variance_rad2)

    for _ in range(MAX_ROUNDS):
        before = least
        for loop in loops:
            for turn_rad in (-FULL_TURN_RAD, FULL_TURN_RAD):
                if _least_cost(graph, poses, loop, turn_rad, variance_rad2) >= least:
                    continue

                start = _wound(graph, poses, loop, turn_rad, variance_rad2)
                found = optimize(replace(graph, poses=start))
                found_cost = cost(found, graph.constraints)
                if found_cost < least:
                    poses, least = found, found_cost

        if least == before:
            break

    return poses


def _independent(graph: PoseGraph, variance_rad2: Floats) -> list[Loop]:
    """Choose loops, each of which may have a full turn more than all others, those along which the
    heading is least certain first. `variance_rad2` (n,) is summed along the path.
    """
    closures = graph.closures
    spread_rad2 = variance_rad2[closures.j] - variance_rad2[closures.i]
    chosen: list[Loop] = []

    for closure in np.argsort(-spread_rad2, kind="stable").tolist():
        ends = np.array([closures.i[closure], closures.j[closure]])
        apart_rad2 = [
            float(np.abs(variance_rad2[ends] - variance_rad2[list(loop)]).sum()) for loop in chosen
        ]
        if min(apart_rad2, default=np.inf) * INDEPENDENT_SD**2 >= FULL_TURN_RAD**2:
            chosen.append((int(ends[0]), int(ends[1])))
        if len(chosen) == MAX_LOOPS:
            break

    return chosen


def _least_cost(
    graph: PoseGraph, poses: Floats, loop: Loop, turn_rad: float, variance_rad2: Floats
) -> float:
    """Return the cost of the turns alone along a loop that turns by so much more than `poses`."""
    first, last = loop
    turned_rad = residuals(poses, graph.steps)[first:last, 2].sum() + turn_rad
    return float(turned_rad**2 / (variance_rad2[last] - variance_rad2[first]))


def _wound(
    graph: PoseGraph, poses: Floats, loop: Loop, turn_rad: float, variance_rad2: Floats
) -> Floats:
    """Return (n, 3) poses that turn by so much more along a loop, where headings are uncertain, and
    otherwise as `poses` do; positions follow by path integration.
    """
    first, last = loop
    spread_rad2 = variance_rad2[last] - variance_rad2[first]
    share = ((variance_rad2 - variance_rad2[first]) / spread_rad2).clip(0.0, 1.0)
    heading_rad = poses[:, 2] + share * turn_rad

    steps_m = matvec(rotation_matrices(heading_rad[:-1]), graph.steps.measurement[:, :2])
    positions_m = poses[0, :2] + cumulative(steps_m)
    return np.column_stack([positions_m, wrap_angle(heading_rad)])
