"""Pose graphs, their residuals, and the optimization of headings too."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cogmap.errors import MessageError
from cogmap.estimation.least_squares import optimize
from cogmap.estimation.pose_graph import (
    PoseGraph,
    cost,
    jacobians,
    residuals,
    sqrt_information,
)
from tests.support.world.laps import error_m, laps, one_between

NUDGE = 1e-6


def test_a_path_that_lacks_a_step_is_refused() -> None:
    graph = laps().graph
    missing = graph.constraints.select(np.arange(len(graph.constraints)) != 7)

    with pytest.raises(MessageError, match="from pose 7 to the next"):
        PoseGraph.of(graph.poses, missing)


def test_the_jacobians_are_those_of_finite_differences() -> None:
    graph = laps().graph
    loops = graph.closures
    by_first, by_second = jacobians(graph.poses, loops)
    ends = ((by_first, loops.i), (by_second, loops.j))

    for index, (by_end, end), axis in itertools.product((0, 5), ends, range(3)):
        nudge = np.zeros_like(graph.poses)
        nudge[end[index], axis] = NUDGE
        there = residuals(graph.poses + nudge, loops)[index]
        back = residuals(graph.poses - nudge, loops)[index]
        slope = (there - back) / (2 * NUDGE)

        assert by_end[index][:, axis] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_optimizing_headings_comes_nearer_to_the_truth_at_a_minimum(seed: int) -> None:
    measured = laps(seed=seed)
    graph = measured.graph
    poses = optimize(graph)
    assert error_m(poses, measured.truth) < 0.5 * error_m(graph.poses, measured.truth)

    least = cost(poses, graph.constraints)
    rng = np.random.default_rng(seed)
    for _ in range(20):
        nudged = poses + rng.normal(0.0, 1e-3, poses.shape)
        nudged[0] = poses[0]
        assert cost(nudged, graph.constraints) > least


def test_without_closures_optimizing_keeps_the_path() -> None:
    alone = laps().without_closures()

    assert optimize(alone) == pytest.approx(alone.poses)


def test_sqrt_information_is_a_root_of_singular_information_too() -> None:
    random = np.random.default_rng(0).normal(size=(4, 3, 3))
    information = random @ random.transpose(0, 2, 1)
    information[2, 2, :] = 0.0
    information[2, :, 2] = 0.0
    root = sqrt_information(information)

    assert root @ root.transpose(0, 2, 1) == pytest.approx(information)


def test_residuals_of_headings_are_wrapped() -> None:
    poses = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, -3.0]])
    known = one_between(0, 1, (0.0, 0.0, 0.0), np.ones(3))
    heading_rad = residuals(poses, known)[0, 2]

    assert heading_rad == pytest.approx(2 * np.pi - 6.0)
