"""The paper's rule (eq. 9) for many loops, compared with least squares."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.map_correction.reference import best_positions
from cogmap.estimation.pose_graph import Constraints, PoseGraph
from cogmap.estimation.reverse_replay import (
    Loops,
    close_loops,
    displacements,
    position_cost,
)
from cogmap.geometry.se2 import integrate, rotate
from tests.support.world.laps import START, laps, one_between, steps_along

UNIT_SD = np.ones(3)


def _straight(length: int, closure: Constraints) -> PoseGraph:
    """A path of steps of a metre ahead, with one closure."""
    measured = np.tile([1.0, 0.0, 0.0], (length, 1))
    return PoseGraph(integrate(START, measured), steps_along(measured, UNIT_SD), closure)


def _cost(graph: PoseGraph, positions_m: np.ndarray) -> float:
    """Eq. 7: the cost of positions where the headings are known."""
    known = displacements(graph.poses, graph.constraints)
    return position_cost(positions_m, graph.constraints, known)


def test_eq_9_shifts_each_place_by_the_share_of_variance_before_it() -> None:
    certain = one_between(0, 8, (6.0, 4.0, 0.0), np.array([1e-4, 1e-4, 1.0]))
    graph = _straight(10, certain)
    found = close_loops(graph)

    shift_m = found.positions_m - graph.poses[:, :2]
    share = np.minimum(np.arange(11), 8) / 8
    expected_m = share[:, None] * [-2.0, 4.0]
    assert shift_m == pytest.approx(expected_m, abs=1e-6)
    assert found.replays == 1


def test_an_uncertain_closure_moves_the_path_by_its_share_of_precision() -> None:
    uncertain = one_between(0, 4, (0.0, 0.0, 0.0), np.array([2.0, 2.0, 1.0]))
    graph = _straight(4, uncertain)
    found = close_loops(graph, tolerance=1e-9)

    assert found.positions_m[-1] == pytest.approx([4.0 - 4.0 * 4 / (4 + 4), 0.0])


@pytest.mark.parametrize("seed", range(3))
def test_replays_of_overlapping_loops_converge_to_least_squares(seed: int) -> None:
    graph = laps(seed=seed, false=2).graph
    exact_m = best_positions(graph)
    least = _cost(graph, exact_m)

    loose = close_loops(graph, 0.05)
    close = close_loops(graph, 1e-9)

    assert least * 0.999999 <= _cost(graph, loose.positions_m) <= 1.05 * least
    assert close.positions_m == pytest.approx(exact_m, abs=1e-2)
    assert loose.replays < close.replays


def test_the_costs_that_end_replay_are_eq_7_and_a_lower_bound_of_it() -> None:
    graph = laps().graph
    loops = Loops(graph)
    least = _cost(graph, best_positions(graph))
    forces = np.random.default_rng(0).normal(0.0, 0.1, (len(graph.closures), 2))
    total, bound = loops.costs(forces)

    assert total == pytest.approx(_cost(graph, loops.positions_m(forces)))
    assert bound < least < total


def _backwards(graph: PoseGraph) -> Constraints:
    """The closures of a graph as measured from their later ends."""
    ends = graph.closures
    ahead_m = displacements(graph.poses, ends).offset_m
    measured = np.zeros((len(ends), 3))
    measured[:, :2] = rotate(-ahead_m, -graph.poses[ends.j, 2])
    return Constraints(ends.j, ends.i, measured, ends.information)


def test_a_closure_measured_backwards_is_the_same_closure() -> None:
    measured = laps()
    turned = measured.with_closures(_backwards(measured.graph))
    forwards = close_loops(measured.graph, 1e-6)
    backwards = close_loops(turned, 1e-6)

    assert backwards.positions_m == pytest.approx(forwards.positions_m, abs=1e-2)


def test_reverse_replay_keeps_the_first_position() -> None:
    graph = laps().graph
    closed = close_loops(graph)

    assert closed.positions_m[0] == pytest.approx(graph.poses[0, :2])


def test_without_closures_reverse_replay_keeps_the_path() -> None:
    alone = laps().without_closures()

    assert close_loops(alone).positions_m == pytest.approx(alone.poses[:, :2])
