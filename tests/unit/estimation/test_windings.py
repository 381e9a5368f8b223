"""Loops whose headings have drifted by about half a turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import Constraints, PoseGraph, cost, diagonal_information
from cogmap.estimation.windings import optimize_windings
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import FULL_TURN_RAD, integrate, relative

SIDE = 10
STEP_M = 5.0
TURN_SD = 0.1
AGAIN = 5


def _path(turned_too_far_rad: float) -> Floats:
    """Steps three times round a rectangle and on, (n, 3), whose corners turn too far together."""
    steps = np.tile([STEP_M, 0.0, 0.0], (3 * 4 * SIDE + AGAIN, 1))
    steps[: 2 * SIDE, 0] *= 2
    corners = np.arange(SIDE - 1, len(steps), SIDE)
    steps[corners, 2] = np.pi / 2 + turned_too_far_rad / len(corners)
    return steps


def _graph(drift_rad: float) -> tuple[Floats, PoseGraph]:
    """True poses (n, 3), and a path that has drifted, closed where it began."""
    truth = integrate(np.zeros(3), _path(0.0))
    felt = _path(drift_rad)
    numbers = np.arange(len(felt))
    first = np.array([0, AGAIN])
    last = np.array([len(felt) - AGAIN, len(felt)])
    turned_rad = np.where(felt[:, 2] > 0, TURN_SD * np.pi / 2, 1e-3)
    steps = diagonal_information(position=np.full(len(felt), 4.0), heading=turned_rad**-2)
    closures = diagonal_information(position=np.full(2, 4.0), heading=np.full(2, 400.0))
    return truth, PoseGraph(
        poses=integrate(np.zeros(3), felt),
        steps=Constraints(i=numbers, j=numbers + 1, measurement=felt, information=steps),
        closures=Constraints(
            i=first, j=last, measurement=relative(truth[first], truth[last]), information=closures
        ),
    )


def _error_m(poses: Floats, truth: Floats) -> float:
    return float(np.hypot(*(poses - truth)[:, :2].T).max())


@pytest.mark.parametrize("turns", [-1, 1])
def test_a_path_is_turned_back_that_was_closed_by_a_full_turn_too_many(turns: int) -> None:
    truth, graph = _graph(drift_rad=0.4)
    wound = integrate(np.zeros(3), _path(turns * FULL_TURN_RAD))
    closed = optimize(replace(graph, poses=wound))
    assert _error_m(closed, truth) > 10 * STEP_M

    found = optimize_windings(replace(graph, poses=closed))

    assert _error_m(found, truth) < STEP_M


def test_of_two_windings_the_one_that_costs_less_is_found() -> None:
    _, graph = _graph(drift_rad=1.2 * np.pi)
    closed = optimize(graph)

    found = optimize_windings(graph)

    assert cost(found, graph.constraints) <= cost(closed, graph.constraints)


def test_a_path_that_turns_hardly_wrong_is_optimized_once() -> None:
    truth, graph = _graph(drift_rad=0.2)

    found = optimize_windings(graph)

    assert np.array_equal(found, optimize(graph))
    assert _error_m(found, truth) < STEP_M
