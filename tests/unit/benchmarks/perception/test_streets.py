"""The truth about road edges and depth that estimates are compared with."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.perception import streets, towns
from cogmap.schemas.sensing import Pose


def test_depth_is_judged_from_three_to_thirty_metres_where_it_is_known() -> None:
    true_m = np.array([[2.0, 10.0, 20.0, 31.0, 0.0, 4.0]], np.float32)
    depth_m = np.array([[1.0, 11.0, 19.0, 60.0, 5.0, 0.0]], np.float32)

    errors, known = towns.depth_errors(depth_m, true_m)

    np.testing.assert_allclose(errors, [0.1, 0.05], rtol=1e-5)
    assert known == pytest.approx(2 / 3)


def test_streets_end_at_the_outline_of_them_all_and_not_where_they_cross() -> None:
    eastwards = (-20.0, -4.0, 20.0, 4.0)
    northwards = (-4.0, -20.0, 4.0, 20.0)
    edges = streets.edges([eastwards, northwards])
    points_m = [(0.0, 0.0), (10.0, 3.0), (10.0, 5.5), (4.0, 4.0), (0.0, 4.0), (21.0, 0.0)]

    found_m = streets.distances_m(points_m, edges)
    nothing = streets.distances_m(np.empty((0, 2)), edges)

    np.testing.assert_allclose(found_m, [math.hypot(4, 4), 1.0, 1.5, 0.0, 4.0, 1.0])
    assert nothing.shape == (0,)


def test_points_ahead_of_a_robot_that_looks_north_are_north_of_it() -> None:
    facing_north = Pose(x_m=1.0, y_m=2.0, heading_rad=math.pi / 2)
    ahead, left = streets.in_town([(3.0, 0.0), (0.0, 1.0)], facing_north)

    np.testing.assert_allclose(ahead, (1.0, 5.0), atol=1e-12)
    np.testing.assert_allclose(left, (0.0, 2.0), atol=1e-12)
