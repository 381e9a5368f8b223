"""The motion that brings points onto others."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.alignment import motion_onto
from cogmap.geometry.se2 import transform_from

POINTS_M = np.array([[0.0, 0.0], [3.0, 1.0], [-2.0, 4.0]])
POSE = np.array([1.0, -2.0, 0.7])
MOVED_M = transform_from(POSE, POINTS_M)


def test_points_are_moved_onto_others_by_the_pose_that_moved_those() -> None:
    assert motion_onto(POINTS_M, MOVED_M) == pytest.approx(POSE)


def test_a_point_without_weight_moves_nothing() -> None:
    with_outlier_m = np.vstack([MOVED_M, [[50.0, 50.0]]])
    points_m = np.vstack([POINTS_M, [[1.0, 1.0]]])

    found = motion_onto(points_m, with_outlier_m, np.array([1.0, 1.0, 1.0, 0.0]))
    assert found == pytest.approx(POSE)


def test_a_prior_holds_the_turn_back() -> None:
    assert 0.0 < motion_onto(POINTS_M, MOVED_M, unturned_information=10.0)[2] < POSE[2]
    assert motion_onto(POINTS_M[:1], MOVED_M[:1], unturned_information=1.0)[2] == 0.0
