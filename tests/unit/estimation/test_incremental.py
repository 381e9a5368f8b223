"""Closures added one at a time, compared with all solved together."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation import incremental
from cogmap.estimation.incremental import IncrementalSolver
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import cost
from tests.support.world.laps import CLOSURE_SD, laps, one_between

FAR = one_between(0, 80, (15.0, -15.0, 1.0), CLOSURE_SD / 10)


def test_one_more_closure_is_taken_in_as_if_all_had_been_solved_together() -> None:
    measured = laps()
    closures = measured.graph.closures
    is_late = np.arange(len(closures)) % 3 == 0
    early = closures.select(~is_late)
    late = closures.select(is_late)
    together = optimize(measured.with_closures(early + late))
    least = cost(together, measured.graph.constraints)

    solver = IncrementalSolver(measured.with_closures(early))
    for index in range(len(late)):
        poses = solver.add(late.select(np.array([index])))
    assert cost(poses, measured.graph.constraints) <= 1.01 * least

    solver.relinearize()
    assert solver.graph.poses == pytest.approx(together, abs=2e-2)


def test_a_closure_that_turns_the_path_far_is_optimized_anew() -> None:
    measured = laps(2)
    solver = IncrementalSolver(measured.without_closures())
    poses = solver.add(FAR)

    together = optimize(measured.with_closures(FAR))
    least = cost(together, solver.graph.constraints)

    assert cost(poses, solver.graph.constraints) <= 1.02 * least


def _cost(solver: IncrementalSolver) -> float:
    """Of the poses that a solver has."""
    return cost(solver.graph.poses, solver.graph.constraints)


def test_relinearizing_completes_what_added_closures_left_undone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    measured = laps(2)
    constraints = measured.graph.steps + FAR
    together = optimize(measured.with_closures(FAR))
    least = cost(together, constraints)

    monkeypatch.setattr(incremental, "ITERATIONS_PER_CLOSURE", 1)
    hasty = IncrementalSolver(measured.without_closures())
    poses = hasty.add(FAR)
    assert cost(poses, constraints) > 1.1 * least

    hasty.relinearize()
    assert _cost(hasty) == pytest.approx(least, rel=0.02)


def test_a_closures_chi_square_is_what_it_adds_to_the_cost() -> None:
    measured = laps()
    closures = measured.graph.closures
    first_six = closures.select(slice(0, 6))
    one_more = closures.select(slice(6, 7))

    solver = IncrementalSolver(measured.with_closures(first_six))
    before = _cost(solver)
    chi_square = solver.chi_square(one_more)
    solver.add(one_more)
    solver.relinearize()

    added = _cost(solver) - before
    assert added == pytest.approx(chi_square, rel=0.05)
