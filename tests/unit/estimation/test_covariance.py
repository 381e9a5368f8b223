"""Joint covariances of poses, beside the inverse of the whole normal equations."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.covariance import joint_covariances
from cogmap.estimation.least_squares import NormalEquations
from cogmap.estimation.pose_graph import Constraints, PoseGraph, diagonal_information
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import relative


def _constraints(poses: Floats, i: Indices, j: Indices, sd_m: float) -> Constraints:
    """What was measured without error."""
    information = diagonal_information(np.full(len(i), sd_m**-2), np.full(len(i), 100.0))
    return Constraints(i, j, relative(poses[i], poses[j]), information)


def _graph(closures: int, seed: int = 1) -> PoseGraph:
    """Three laps of a circle, with closures between any two laps."""
    rng = np.random.default_rng(seed)
    numbers = np.arange(90)
    angles = 2 * np.pi * numbers / 30
    poses = np.column_stack([9 * np.cos(angles), 9 * np.sin(angles), angles + np.pi / 2])
    i = rng.integers(0, 60, closures)
    j = i + 30 + rng.integers(-2, 3, closures)
    return PoseGraph(
        poses,
        steps=_constraints(poses, numbers[:-1], numbers[1:], 0.1),
        closures=_constraints(poses, i, j.clip(0, 89), 0.3),
    )


def _whole(graph: PoseGraph) -> Floats:
    """The covariance of all poses, (n, 3, n, 3), by the inverse."""
    count = len(graph.poses)
    normal = NormalEquations(count, graph.constraints)
    inverse = np.linalg.inv(normal.matrix(graph.poses, graph.constraints).toarray())
    rows, _ = normal.unknowns(np.arange(1, count))
    whole = np.zeros((count, 3, count, 3))
    whole[1:, :, 1:] = inverse[np.ix_(rows.ravel(), rows.ravel())].reshape(
        count - 1, 3, count - 1, 3
    )
    return whole


@pytest.mark.parametrize("closures", [0, 1, 40])
def test_what_is_asked_for_together_is_as_in_the_inverse(closures: int) -> None:
    graph = _graph(closures)
    groups = [np.array(group) for group in ([7], [3, 80], [10, 12, 40, 41, 71], [88, 89])]
    whole = _whole(graph)

    for group, found in zip(groups, joint_covariances(graph, groups), strict=True):
        size = 3 * len(group)
        expected = whole[group][:, :, group].reshape(size, size)
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_the_first_pose_is_known() -> None:
    (found,) = joint_covariances(_graph(5), [np.array([0, 31])])

    assert not found[:3].any()
    assert not found[:, :3].any()
    assert (np.diagonal(found)[3:] > 0).all()


def test_a_path_of_one_step_has_the_step_s_covariance() -> None:
    poses = np.zeros((2, 3))
    step = _constraints(poses, np.array([0]), np.array([1]), 0.5)
    nothing = step.select(slice(0, 0))
    (found,) = joint_covariances(PoseGraph(poses, step, nothing), [np.array([1])])

    assert found == pytest.approx(np.diag([0.25, 0.25, 0.01]))
