"""Loops closed by reverse replay: eq. 9 of the paper for one loop, and for many that overlap.
Positions only.

Eq. 9 gives every position of a loop a share of its discrepancy, as large as the share of path
integration's variance that lies before it. Seen as forces: a closed loop pulls with one force on
each of its steps, and a step yields by its own covariance times the force. Where loops overlap,
their forces add up. One replay from the last position to the first finds the sum at each step: a
loop's force enters at its end and leaves at its beginning. Each loop then corrects its force by its
own precision A_i times what is left of its discrepancy, and replay begins anew. The learning rate
alpha of a replay and how much it takes over from the replay before are those of conjugate
gradients; with them a handful of replays closes a few loops, and some hundred close thousands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cogmap.estimation.pose_graph import (
    Constraints,
    PoseGraph,
    diagonal_information,
    matvec,
    residuals,
)
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import cumulative, rotate, rotation_matrices

# Replays between two computations of the cost, which takes about as long as a replay.
CHECK_EVERY = 10


@dataclass(frozen=True)
class Correction:
    """(n, 2) `positions_m` and the number of times that the path was replayed.

    `cost` is eq. 7 for them, headings unchanged; `least_cost` is a lower bound of it.
    """

    positions_m: Floats
    replays: int
    cost: float
    least_cost: float


@dataclass(frozen=True)
class Displacements:
    """Constraints between positions, in the world's frame: (m, 2) `offset_m` from position i to j
    and (m, 2, 2) covariances.
    """

    offset_m: Floats
    covariance_m2: Floats


def displacements(poses: Floats, constraints: Constraints) -> Displacements:
    """Return what `constraints` measure of positions if the headings are those of `poses`."""
    covariance = _inverse(constraints.information[:, :2, :2])

    # If position and heading are measured together, the position that is expected changes with the
    # error of the heading.
    heading_error_rad = residuals(poses, constraints)[:, 2]
    coupling = constraints.information[:, :2, 2] * heading_error_rad[:, None]
    expected_m = constraints.measurement[:, :2] - matvec(covariance, coupling)

    heading_rad = poses[constraints.i, 2]
    turn = rotation_matrices(heading_rad)
    return Displacements(
        rotate(expected_m, heading_rad),
        turn @ covariance @ turn.mT,
    )


def position_cost(positions_m: Floats, constraints: Constraints, known: Displacements) -> float:
    """Compute eq. 7 for (n, 2) positions."""
    origin_m = positions_m[constraints.i]
    offset_m = positions_m[constraints.j] - origin_m

    error_m = offset_m - known.offset_m
    return _weighted_squares(error_m, known.covariance_m2)


class Loops:
    """The loops of one path, and the forces by which they hold it together."""

    def __init__(self, graph: PoseGraph) -> None:
        # Each loop is turned so that it starts before it ends.
        closures = graph.closures
        backwards = closures.i > closures.j
        self._start = np.where(backwards, closures.j, closures.i)
        self._end = np.where(backwards, closures.i, closures.j)

        closing = displacements(graph.poses, closures)
        self._closing_m = np.where(backwards[:, None], -closing.offset_m, closing.offset_m)
        self._closing_m2 = closing.covariance_m2

        # Path integration alone, from the first pose.
        step = displacements(graph.poses, graph.steps)
        self._integrated_m = graph.poses[0, :2] + cumulative(step.offset_m)
        self._step_m2 = step.covariance_m2

        along_m2 = self._across(cumulative(self._step_m2))
        self.gain = _inverse(along_m2 + self._closing_m2)

    @property
    def discrepancy_m(self) -> Floats:
        """Return d_i of every loop, (m, 2), after path integration alone."""
        integrated_m = self._across(self._integrated_m)
        return self._closing_m - integrated_m

    def shifts(self, forces: Floats) -> Floats:
        """Replay once in reverse: return (n, 2) shifts of the positions under (m, 2) forces (eq.
        9's alpha A d p, summed up).
        """
        entering = self._summed(self._end, forces)
        leaving = self._summed(self._start, forces)
        change = entering - leaving

        pull = np.cumsum(change[::-1], axis=0)[::-1]
        stretched_m = matvec(self._step_m2, pull[1:])
        return cumulative(stretched_m)

    def yielded(self, forces: Floats) -> Floats:
        """Compute how far `forces` close each loop, (m, 2): path and closure both yield."""
        by_path_m = self._across(self.shifts(forces))
        by_closure_m = matvec(self._closing_m2, forces)
        return by_path_m + by_closure_m

    def positions_m(self, forces: Floats) -> Floats:
        """Return the path under `forces`, (n, 2)."""
        shifts_m = self.shifts(forces)
        return self._integrated_m + shifts_m

    def costs(self, forces: Floats) -> tuple[float, float]:
        """Compute eq. 7 of the path under `forces`, and a lower bound for any forces (its dual)."""
        yielded_m = self.yielded(forces)
        by_closure_m = matvec(self._closing_m2, forces)
        work = _dot(forces, yielded_m)
        in_steps = work - _dot(forces, by_closure_m)

        # A closure is misfitted by what the path does not yield.
        discrepancy_m = self.discrepancy_m
        misfit_m = discrepancy_m - yielded_m + by_closure_m
        in_closures = _weighted_squares(misfit_m, self._closing_m2)

        bound = 2 * _dot(forces, discrepancy_m) - work
        return in_steps + in_closures, bound

    def _across(self, along: Floats) -> Floats:
        """Return the change of (n, ...) values along the path from each loop's start to its end."""
        change: Floats = along[self._end] - along[self._start]
        return change

    def _summed(self, places: Indices, forces: Floats) -> Floats:
        """Sum the forces that act at each place, (n, 2)."""
        count = len(self._integrated_m)

        x = np.bincount(places, forces[:, 0], count)
        y = np.bincount(places, forces[:, 1], count)
        return np.column_stack([x, y])


def close_loops(graph: PoseGraph, tolerance: float = 0.01, max_replays: int = 5000) -> Correction:
    """Replay the path in reverse until the cost of eq. 7 is within `tolerance` of its least.

    The headings of `graph.poses` stay, and its first position.
    """
    loops = Loops(graph)
    search = _ConjugateGradients(loops)

    total, bound = loops.costs(search.forces)
    while total > (1 + tolerance) * max(bound, 0.0) + 1e-12:
        if search.replays >= max_replays or search.gained <= 0:
            break

        search.replay()
        if search.replays % CHECK_EVERY == 0 or search.replays < CHECK_EVERY:
            total, bound = loops.costs(search.forces)

    total, bound = loops.costs(search.forces)
    return Correction(
        positions_m=loops.positions_m(search.forces),
        replays=search.replays,
        cost=total,
        least_cost=bound,
    )


def with_positions_only(graph: PoseGraph) -> PoseGraph:
    """Return the path whose headings are not corrected: the positions take up their errors.

    On average, a turn of variance h somewhere on a loop of length L moves its end by a variance of
    h L^2 / 3. Views of landmarks turn with the headings of their whole loop.
    """
    loops = graph.closures + graph.joins
    if not len(loops):
        return graph

    def between_ends(values: Floats) -> Floats:
        """Sum the (n,) values of the steps between the ends of each loop, (m,)."""
        summed = cumulative(values)
        return np.asarray(np.abs(summed[loops.j] - summed[loops.i]))

    steps = graph.steps
    lengths_m = between_ends(np.hypot(*steps.measurement[:, :2].T))
    by_heading_m2 = (lengths_m**2).mean() / 3 * steps.variance_rad2
    information = diagonal_information(
        position=1 / (steps.variance_m2 + by_heading_m2),
        heading=steps.information[:, 2, 2],
    )

    # The lever arms of views turn with the headings along their loops.
    lever_arms2 = (loops.information[:, :2, 2] ** 2).sum(axis=1)
    variance_share = lever_arms2 / loops.information[:, 0, 0] * between_ends(steps.variance_rad2)
    weakened = replace(steps, information=information)
    return PoseGraph(graph.poses, weakened, loops.weighted(1 / (1 + variance_share)))


class _ConjugateGradients:
    """The forces of `loops`, corrected replay by replay, as many as `replays` so far.

    `gained` is what the next replay would gain; it is not above 0 if nothing is left to gain.
    """

    def __init__(self, loops: Loops) -> None:
        self._loops = loops
        self._left_m = loops.discrepancy_m
        self._direction = matvec(loops.gain, self._left_m)

        self.forces = np.zeros_like(self._left_m)
        self.gained = _dot(self._left_m, self._direction)
        self.replays = 0

    def replay(self) -> None:
        """Replay once, and correct each force by what is left of its loop's discrepancy."""
        yielded_m = self._loops.yielded(self._direction)
        rate = self.gained / _dot(self._direction, yielded_m)
        self.forces = self.forces + rate * self._direction
        self._left_m = self._left_m - rate * yielded_m
        self.replays += 1

        correction = matvec(self._loops.gain, self._left_m)
        gained = _dot(self._left_m, correction)

        taken_over = gained / self.gained
        self._direction = correction + taken_over * self._direction
        self.gained = gained


def _dot(one: Floats, other: Floats) -> float:
    return float(np.sum(one * other))


def _inverse(matrices: Floats) -> Floats:
    return np.asarray(np.linalg.inv(matrices), np.float64)


def _weighted_squares(errors_m: Floats, covariance_m2: Floats) -> float:
    """Sum d' S^-1 d over (m, 2) errors."""
    solved = np.linalg.solve(covariance_m2, errors_m[..., None])
    squares = errors_m * solved[..., 0]
    return float(np.sum(squares))
