"""Routes of legs and turns as lines with rounded corners."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.action.route import STEP_M, Route
from tests.support.paths import steps_m

QUARTER = math.pi / 2


def _route(
    *legs: tuple[float, float], corner_radius_m: float = 3.5, overrun_m: float = 5.0
) -> Route:
    return Route.of_legs([*legs], corner_radius_m, overrun_m)


def test_a_straight_leg_is_a_line_along_x_with_its_overrun() -> None:
    route = _route((20.0, 0.0))
    x_m, y_m = route.points_m.T

    assert route.left_m == pytest.approx(25.0, abs=STEP_M)
    assert x_m[0] == pytest.approx(0.0)
    assert x_m[-1] == pytest.approx(25.0, abs=STEP_M)
    assert np.abs(y_m).max() == 0.0


@pytest.mark.parametrize(
    ("turn_rad", "end_m"), [(QUARTER, (20.0, 35.0)), (-QUARTER, (20.0, -35.0))]
)
def test_a_turn_is_left_where_it_is_positive(turn_rad: float, end_m: tuple[float, float]) -> None:
    route = _route((20.0, turn_rad), (30.0, 0.0))
    last_m = route.points_m[-1]

    assert last_m == pytest.approx(end_m, abs=STEP_M)


def test_a_rounded_corner_leaves_and_meets_its_legs_a_radius_away() -> None:
    route = _route((20.0, QUARTER), (20.0, 0.0))
    x_m, y_m = route.points_m.T
    assert (y_m[x_m < 16.4] == 0.0).all()
    assert x_m[y_m > 3.6] == pytest.approx(20.0)

    to_corner_m = np.hypot(x_m - 20.0, y_m).min()
    cut_m = 3.5 * (math.sqrt(2) - 1)
    assert 0.5 < to_corner_m < cut_m + 0.5

    headings_rad = np.arctan2(np.diff(y_m), np.diff(x_m))
    assert np.abs(np.diff(headings_rad)).max() < 0.25


def test_a_rounded_corner_is_shorter_than_its_legs() -> None:
    legs = ((20.0, QUARTER), (20.0, 0.0))
    sharp = _route(*legs, corner_radius_m=0.01)
    rounded = _route(*legs)
    saved_m = 2 * 3.5 - 1.62 * 3.5

    assert rounded.left_m == pytest.approx(sharp.left_m - saved_m, abs=2 * STEP_M)


def test_between_short_legs_a_corner_is_as_wide_as_they_allow() -> None:
    route = _route((2.0, QUARTER), (2.0, QUARTER), (2.0, 0.0), overrun_m=2.0)
    x_m, y_m = route.points_m.T

    assert x_m.min() >= -2.01
    assert x_m.max() <= 2.0
    assert y_m.min() == pytest.approx(0.0, abs=0.01)
    assert y_m.max() == pytest.approx(2.0, abs=0.01)


def test_points_lie_a_step_apart() -> None:
    legs = ((20.0, QUARTER), (10.0, -QUARTER), (15.0, 0.3), (8.0, 0.0))
    route = _route(*legs)

    assert steps_m(route.points_m) == pytest.approx(STEP_M, abs=0.02)


def test_the_agent_advances_along_the_line_and_never_back() -> None:
    route = _route((20.0, QUARTER), (20.0, 0.0))
    route.advance(5.0, 0.4)

    assert route.travelled_m == pytest.approx(5.0, abs=STEP_M)

    route.advance(2.0, 0.0)

    assert route.travelled_m == pytest.approx(5.0, abs=STEP_M)


def test_where_the_line_comes_by_again_the_agent_stays_on_its_lap() -> None:
    route = _route(*[(40.0, QUARTER)] * 8)
    for x_m in np.arange(0.0, 30.0, 1.0):
        route.advance(float(x_m), 0.0)

    assert route.travelled_m == pytest.approx(29.0, abs=STEP_M)


def test_the_legs_end_in_the_middle_of_their_corners_on_every_lap() -> None:
    route = _route(*[(20.0, QUARTER)] * 8)
    corners_m = [(20.0, 0.0), (20.0, 20.0), (0.0, 20.0), (0.0, 0.0)] * 2

    for end_m, corner_m in zip(route.leg_ends_m, corners_m, strict=True):
        point_m = route.points_m[round(end_m / STEP_M)]
        assert math.dist(point_m, corner_m) < 1.6


def test_the_leg_changes_at_its_corner() -> None:
    route = _route(*[(20.0, QUARTER)] * 8)

    for distance_m in np.arange(0.0, 38.0, 1.0):
        after_corner_m = distance_m - 20.0
        route.advance(min(distance_m, 20.0), max(0.0, after_corner_m))
        if abs(after_corner_m) > 2.0:
            assert route.leg == int(after_corner_m > 0)


def test_curvature_is_that_of_the_bend_ahead_and_none_on_the_straight() -> None:
    route = _route((40.0, QUARTER), (40.0, 0.0))
    on_the_straight = route.sharpest(10.0)
    of_the_bend = route.sharpest(60.0)

    assert on_the_straight == 0.0
    assert 1 / 3.5 < of_the_bend < 2 / 3.5


def test_the_point_ahead_stops_at_the_end_of_the_line() -> None:
    route = _route((10.0, 0.0))
    last_m = route.points_m[-1]

    assert route.ahead(4.0) == pytest.approx((4.0, 0.0))
    assert route.ahead(400.0) == pytest.approx(last_m)


def test_a_closed_loop_ends_on_the_street_where_it_began() -> None:
    route = _route(*[(40.0, QUARTER)] * 4, overrun_m=5.0)
    last_m = route.points_m[-1]

    assert route.left_m == pytest.approx(165.0, rel=0.1)
    assert last_m == pytest.approx((5.0, 0.0), abs=STEP_M)
