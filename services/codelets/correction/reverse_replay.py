"""Loops closed by reverse replay: eq. 9 of the paper for one loop, and for many that overlap.
Positions only.

Eq. 9 gives every position of a loop a share of its discrepancy, as large as the share of path
integration's uncertainty that lies before it. Seen as forces: a closed loop pulls with one force on
each of its steps, and a step yields by its own covariance times the force. Where loops overlap,
their forces add up. One replay from the last position to the first finds the sum at each step: a
loop's force comes in at its end and goes out at its beginning. Each loop then corrects its force by
its own precision A_i times what is left of its discrepancy, and replay begins anew. The learning
rate alpha of a replay and how much it takes over from the replay before are those of conjugate
gradients; with them a handful of replays closes a few loops, and some hundred close thousands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import cumulative, rotation_matrices
from services.codelets.correction.pose_graph import (
    Constraints,
    PoseGraph,
    residuals,
)

CHECK_EVERY = 10


@dataclass(frozen=True)
class Correction:
    """(n, 2) `positions_m` and how often the path was replayed.

    `cost` is eq. 7 for them, headings as they are; `least_cost` is what no positions can be below.
    """

    positions_m: Floats
    replays: int
    cost: float
    least_cost: float


@dataclass(frozen=True)
class Displacements:
    """Constraints between positions, in the world's frame: (m, 2) `off_m` and (m, 2, 2)
    covariances.
    """

    off_m: Floats
    covariance_m2: Floats


def displacements(poses: Floats, constraints: Constraints) -> Displacements:
    """What `constraints` say of positions once the headings of `poses` are taken as they are."""
    turn = rotation_matrices(poses[constraints.i, 2])
    off_rad = residuals(poses, constraints)[:, 2]
    covariance = np.linalg.inv(constraints.information[:, :2, :2])
    # A measured distance that goes with the measured heading changes with how wrong that heading
    # turned out to be.
    along = np.einsum(
        "mab,mb->ma", covariance, constraints.information[:, :2, 2] * off_rad[:, None]
    )
    off_m = np.einsum("mab,mb->ma", turn, constraints.measurement[:, :2] - along)
    return Displacements(off_m, turn @ covariance @ turn.transpose(0, 2, 1))


def position_cost(positions_m: Floats, constraints: Constraints, known: Displacements) -> float:
    """Eq. 7 for (n, 2) positions."""
    off = positions_m[constraints.j] - positions_m[constraints.i] - known.off_m
    return float(
        np.einsum("ma,ma->", off, np.linalg.solve(known.covariance_m2, off[..., None])[..., 0])
    )


class Loops:
    """The loops of one path, and the forces by which they hold it together."""

    def __init__(self, graph: PoseGraph) -> None:
        back = graph.closures.i > graph.closures.j
        self._start = np.where(back, graph.closures.j, graph.closures.i)
        self._end = np.where(back, graph.closures.i, graph.closures.j)
        known = displacements(graph.poses, graph.closures)
        step = displacements(graph.poses, graph.steps)
        self._closing_m = np.where(back[:, None], -known.off_m, known.off_m)
        self._closing_m2 = known.covariance_m2
        self._step_m2 = step.covariance_m2
        self._integrated_m = graph.poses[0, :2] + cumulative(step.off_m)
        so_far_m2 = cumulative(step.covariance_m2)
        self.gain = np.linalg.inv(
            so_far_m2[self._end] - so_far_m2[self._start] + known.covariance_m2
        )

    @property
    def discrepancy_m(self) -> Floats:
        """(m, 2): d_i of every loop, after path integration alone."""
        return self._closing_m - self._across(self._integrated_m)

    def shifts(self, forces: Floats) -> Floats:
        """One reverse replay: (n, 2) shifts of the positions under (m, 2) forces (eq. 9's alpha A d
        p, summed up).
        """
        count = len(self._integrated_m)
        entered = [np.bincount(self._end, forces[:, axis], count) for axis in (0, 1)]
        left = [np.bincount(self._start, forces[:, axis], count) for axis in (0, 1)]
        pull = np.cumsum((np.array(entered) - np.array(left)).T[::-1], axis=0)[::-1]
        return cumulative(np.einsum("kab,kb->ka", self._step_m2, pull[1:]))

    def yielded(self, forces: Floats) -> Floats:
        """(m, 2): by how much `forces` close each loop: the path gives way, and so does the
        closure.
        """
        result: Floats = self._across(self.shifts(forces)) + np.einsum(
            "mab,mb->ma", self._closing_m2, forces
        )
        return result

    def positions_m(self, forces: Floats) -> Floats:
        """(n, 2): the path under `forces`."""
        return self._integrated_m + self.shifts(forces)

    def costs(self, forces: Floats) -> tuple[float, float]:
        """Eq. 7 of the path under `forces`, and the least that it could be for any (its dual)."""
        yielded = self.yielded(forces)
        work = float(np.sum(forces * yielded))
        left = self.discrepancy_m - yielded
        given_way = np.einsum("mab,mb->ma", self._closing_m2, forces)
        # The closure bears what the path has not given way to.
        borne = left + given_way
        strain = float(np.sum(borne * np.linalg.solve(self._closing_m2, borne[..., None])[..., 0]))
        in_steps = work - float(np.sum(forces * given_way))
        return in_steps + strain, 2 * float(np.sum(forces * self.discrepancy_m)) - work

    def _across(self, positions: Floats) -> Floats:
        result: Floats = positions[self._end] - positions[self._start]
        return result


def close_loops(graph: PoseGraph, tolerance: float = 0.01, most_replays: int = 5000) -> Correction:
    """Positions along the path after so many reverse replays that eq. 7 is within `tolerance` of
    its least.

    The headings of `graph.poses` stay, and its first position.
    """
    loops = Loops(graph)
    forces = np.zeros((len(graph.closures), 2))
    left = loops.discrepancy_m
    correction = np.einsum("mab,mb->ma", loops.gain, left)
    towards = correction
    gained = float(np.sum(left * correction))
    replays, total, least = 0, *loops.costs(forces)
    while (
        total > (1 + tolerance) * max(least, 0.0) + 1e-12 and replays < most_replays and gained > 0
    ):
        yielded = loops.yielded(towards)
        rate = gained / float(np.sum(towards * yielded))
        forces = forces + rate * towards
        left = left - rate * yielded
        correction = np.einsum("mab,mb->ma", loops.gain, left)
        gained, before = float(np.sum(left * correction)), gained
        towards = correction + gained / before * towards
        replays += 1
        if replays % CHECK_EVERY == 0 or replays < CHECK_EVERY:
            total, least = loops.costs(forces)
    total, least = loops.costs(forces)
    return Correction(loops.positions_m(forces), replays, total, least)
