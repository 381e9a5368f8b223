"""Poses in the plane: wrapping, composing, frames."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry import se2

RNG = np.random.default_rng(0)
POSES = np.column_stack([RNG.normal(0.0, 5.0, (20, 2)), RNG.uniform(-np.pi, np.pi, 20)])
STEPS = np.column_stack([RNG.normal(0.0, 1.0, (20, 2)), RNG.uniform(-np.pi, np.pi, 20)])
POINTS = RNG.normal(0.0, 5.0, (20, 2))


def test_angles_are_wrapped_to_a_half_turn_to_either_side() -> None:
    angles = np.array([0.0, np.pi, -np.pi, 3.0 + 4 * np.pi, -7.0])
    expected = [0.0, np.pi, np.pi, 3.0, 2 * np.pi - 7.0]

    assert se2.wrap_angle(angles) == pytest.approx(expected)


def test_a_step_in_a_poses_frame_starts_along_its_heading() -> None:
    facing_north = np.array([1.0, 2.0, np.pi / 2])
    step = np.array([3.0, 1.0, 0.2])
    found = se2.compose(facing_north, step)

    assert found == pytest.approx([0.0, 5.0, np.pi / 2 + 0.2])


def test_composing_with_a_relative_pose_leads_back_to_the_pose() -> None:
    steps = se2.relative(POSES, STEPS)

    assert se2.compose(POSES, steps) == pytest.approx(STEPS)


def test_a_quarter_of_a_circle_leads_to_its_radius_ahead_and_aside() -> None:
    assert se2.arc(np.pi, np.pi / 2) == pytest.approx([2.0, 2.0, np.pi / 2])
    assert se2.arc(3.0, 0.0).tolist() == [3.0, 0.0, 0.0]


def test_one_pose_transforms_many_points_as_each_alone() -> None:
    together = se2.transform_from(POSES[0], POINTS)
    alone = [se2.transform_from(POSES[0], point) for point in POINTS]

    assert together == pytest.approx(np.array(alone))


def test_transforming_to_a_frame_undoes_transforming_from_it() -> None:
    there = se2.transform_from(POSES, POINTS)

    assert se2.transform_to(POSES, there) == pytest.approx(POINTS)


def test_rotation_matrices_rotate_as_rotating_does() -> None:
    headings = POSES[:, 2]
    matrices = se2.rotation_matrices(headings)
    by_matrices = np.einsum("nab,nb->na", matrices, POINTS)

    assert by_matrices == pytest.approx(se2.rotate(POINTS, headings))


def test_points_that_move_with_a_pose_keep_their_place_in_its_frame() -> None:
    moved = se2.move_with(POINTS, POSES, STEPS)
    before = se2.transform_to(POSES, POINTS)
    after = se2.transform_to(STEPS, moved)

    assert after == pytest.approx(before)


def test_integrated_steps_are_those_between_the_poses() -> None:
    start = np.array([1.0, 2.0, 3.0])
    poses = se2.integrate(start, STEPS)
    steps = se2.relative(poses[:-1], poses[1:])

    assert poses[0] == pytest.approx(start)
    assert steps == pytest.approx(STEPS)


def test_the_mean_of_poses_has_the_mean_position_and_direction() -> None:
    poses = np.array([[0.0, 2.0, 3.0], [2.0, 4.0, -3.0]])
    mean = se2.mean_pose(poses)

    assert mean == pytest.approx([1.0, 3.0, np.pi])
