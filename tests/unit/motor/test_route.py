"""The routes of plans as smooth lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.services.motor.route import SMOOTHED_M, STEP_M, Route
from tests.support.paths import steps_m
from tests.support.world.plans import Point, places_m

CORNER = ((0.0, 0.0), (20.0, 0.0), (20.0, 20.0))
SQUARE = ((0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0), (0.0, 0.0))


def _route(*corners: Point) -> Route:
    return Route(places_m(*corners))


def test_a_straight_route_is_the_line_between_its_ends() -> None:
    route = _route((0.0, 0.0), (20.0, 0.0))
    x_m, y_m = route.points_m.T

    assert route.left_m == pytest.approx(20.0, abs=2 * STEP_M)
    assert x_m[0] == pytest.approx(0.0)
    assert x_m[-1] == pytest.approx(20.0, abs=2 * STEP_M)
    assert np.abs(y_m).max() < 1e-9


def test_a_route_of_two_places_is_a_line_too() -> None:
    route = _route((0.0, 0.0), (1.0, 0.0))

    assert 0.0 < route.left_m <= 1.0


def test_a_corner_is_rounded_as_far_as_the_line_is_smoothed() -> None:
    route = _route(*CORNER)
    x_m, y_m = route.points_m.T
    rounded_m = SMOOTHED_M / 2 + STEP_M
    assert np.abs(y_m[x_m < 20.0 - rounded_m]).max() < 1e-9
    assert x_m[y_m > rounded_m] == pytest.approx(20.0)

    to_corner_m = np.hypot(x_m - 20.0, y_m).min()
    assert 0.3 < to_corner_m < SMOOTHED_M / 2

    headings_rad = np.arctan2(np.diff(y_m), np.diff(x_m))
    assert np.abs(np.diff(headings_rad)).max() < 0.25


def test_places_beside_one_another_are_driven_past_in_a_smooth_line() -> None:
    across = np.tile([0.0, 1.0], 10)
    route = Route(np.column_stack([np.arange(20.0), across]))
    y_m = route.points_m[8:-8, 1]

    assert y_m.max() - y_m.min() < 0.5


def test_points_lie_a_step_apart() -> None:
    route = _route((0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (35.0, 10.0), (43.0, 14.0))

    assert steps_m(route.points_m) == pytest.approx(STEP_M, abs=0.02)


def test_the_agent_advances_along_the_line_and_never_back() -> None:
    route = _route(*CORNER)
    route.advance(5.0, 0.4)

    assert route.travelled_m == pytest.approx(5.0, abs=STEP_M)

    route.advance(2.0, 0.0)

    assert route.travelled_m == pytest.approx(5.0, abs=STEP_M)


def test_where_the_line_comes_by_again_the_agent_does_not_skip_what_is_between() -> None:
    route = _route(*SQUARE, (30.0, 0.0))
    for x_m in np.arange(0.0, 30.0, 1.0):
        route.advance(float(x_m), 0.0)

    assert route.travelled_m == pytest.approx(29.0, abs=STEP_M)


def test_the_agent_joins_the_line_where_it_is() -> None:
    route = _route(*CORNER)
    route.join(20.3, 12.0)

    assert route.left_m == pytest.approx(8.0, abs=3 * STEP_M)


def test_curvature_is_that_of_the_bend_ahead_and_none_on_the_straight() -> None:
    route = _route((0.0, 0.0), (40.0, 0.0), (40.0, 40.0))
    on_the_straight = route.sharpest(10.0)
    of_the_bend = route.sharpest(60.0)
    quarter_per_m = math.pi / 2 / SMOOTHED_M

    assert on_the_straight == pytest.approx(0.0, abs=1e-9)
    assert quarter_per_m < of_the_bend < 2 * quarter_per_m


def test_the_point_ahead_stops_at_the_end_of_the_line() -> None:
    route = _route((0.0, 0.0), (10.0, 0.0))
    last_m = route.points_m[-1]

    assert route.ahead(4.0) == pytest.approx((4.0, 0.0))
    assert route.ahead(400.0) == pytest.approx(last_m)


def test_a_route_back_to_its_start_ends_there() -> None:
    route = _route(*SQUARE)

    assert route.left_m == pytest.approx(160.0, rel=0.1)
    assert route.points_m[-1] == pytest.approx((0.0, 0.0), abs=3 * STEP_M)
