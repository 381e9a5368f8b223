"""Eq. 7 solved by passes over the path, beside least squares."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from benchmarks.map_correction.reference import best_positions
from cogmap.estimation.gauss_seidel import (
    NormalEquations,
    integrated_m,
    loop_passes,
    passes,
)
from cogmap.estimation.pose_graph import PoseGraph
from cogmap.estimation.reverse_replay import displacements, position_cost
from cogmap.geometry.se2 import integrate
from tests.support.world.laps import START, laps, one_between, steps_along


def _line() -> PoseGraph:
    """Two steps of a metre ahead; the end is seen to be 1 m short of that, as certain as a step."""
    measured = np.tile([1.0, 0.0, 0.0], (2, 1))
    short = one_between(0, 2, (1.0, 0.0, 0.0), np.ones(3))
    return PoseGraph(integrate(START, measured), steps_along(measured, np.ones(3)), short)


def _costs(graph: PoseGraph, paths_m: list[np.ndarray]) -> list[float]:
    known = displacements(graph.poses, graph.constraints)
    return [position_cost(each, graph.constraints, known) for each in paths_m]


def test_each_position_moves_to_where_its_own_constraints_agree() -> None:
    """From 0, 1, 2: forwards the middle stays at (0 + 2) / 2, the end moves to (2 + 1) / 2;
    backwards the end stays, the middle moves to (0 + 1.5) / 2.
    """
    graph = _line()
    forwards_m, backwards_m = (each - graph.poses[0, :2] for each in islice(passes(graph), 2))

    along = graph.poses[1, :2] - graph.poses[0, :2]
    assert forwards_m @ along == pytest.approx([0.0, 1.0, 1.5])
    assert backwards_m @ along == pytest.approx([0.0, 0.75, 1.5])


def test_a_loop_takes_the_force_that_closes_it_at_once() -> None:
    """A metre is missing, over two steps and a closure as certain as each: a third of it each."""
    graph = _line()
    (once_m,) = (each - graph.poses[0, :2] for each in islice(loop_passes(graph), 1))

    along = graph.poses[1, :2] - graph.poses[0, :2]
    assert once_m @ along == pytest.approx([0.0, 2 / 3, 4 / 3])


@pytest.mark.parametrize("seed", range(2))
def test_the_equations_have_the_solution_of_least_squares(seed: int) -> None:
    graph = laps(seed=seed, false=2).graph

    assert NormalEquations(graph).solve() == pytest.approx(best_positions(graph), abs=1e-6)


def test_no_pass_makes_the_cost_larger() -> None:
    graph = laps(seed=1).graph
    for paths in (passes(graph), loop_passes(graph)):
        costs = _costs(graph, [integrated_m(graph), *islice(paths, 12)])

        assert (np.diff(costs[:2]) < 0).all()
        assert (np.diff(costs[1:]) <= 1e-9 * costs[1]).all()


def test_the_first_position_stays() -> None:
    graph = laps(seed=1).graph
    forwards_m, *_ = islice(passes(graph), 1)

    assert forwards_m[0] == pytest.approx(graph.poses[0, :2])
