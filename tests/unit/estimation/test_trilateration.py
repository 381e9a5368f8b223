"""Points by their distances from known places."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.trilateration import positions_from_ranges

POINTS_M = np.array([[20.0, 5.0], [-10.0, 30.0]])
SD_M = 0.5


def _heard(gain: float, wrong_share: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places round a circle of 15 m, the ranges from there to both points in turn, and which."""
    rng = np.random.default_rng(3)
    around_rad = np.linspace(0.0, 2 * np.pi, 200)
    centres_m = 15.0 * np.column_stack([np.cos(around_rad), np.sin(around_rad)])
    point = np.arange(200) % 2

    distance_m = np.hypot(*(POINTS_M[point] - centres_m).T)
    ranges_m = (1 + gain) * distance_m + rng.normal(0.0, SD_M, 200)
    is_wrong = rng.random(200) < wrong_share
    ranges_m[is_wrong] += 25.0
    return centres_m, ranges_m, point


@pytest.mark.parametrize("gain", [0.0, 0.07])
def test_points_are_found_with_the_gain_of_the_ranges(gain: float) -> None:
    centres_m, ranges_m, point = _heard(gain)

    found = positions_from_ranges(centres_m, ranges_m, np.full(200, SD_M), point, gain_sd=0.1)

    positions_m, covariance_m2, found_gain = found
    assert positions_m == pytest.approx(POINTS_M, abs=0.5)
    assert found_gain == pytest.approx(gain, abs=0.015)
    assert np.sqrt(np.trace(covariance_m2, axis1=1, axis2=2)).max() < 0.3


def test_ranges_that_are_wrong_hardly_move_a_point() -> None:
    centres_m, ranges_m, point = _heard(0.0, wrong_share=0.2)

    positions_m, _, _ = positions_from_ranges(
        centres_m, ranges_m, np.full(200, SD_M), point, gain_sd=0.0
    )

    assert positions_m == pytest.approx(POINTS_M, abs=0.5)


def test_a_point_heard_from_one_place_alone_is_somewhere_at_that_distance() -> None:
    centres_m = np.zeros((20, 2))
    ranges_m = np.full(20, 10.0)

    positions_m, _, _ = positions_from_ranges(
        centres_m, ranges_m, np.full(20, SD_M), np.zeros(20, np.int64), gain_sd=0.0
    )

    assert np.hypot(*positions_m[0]) == pytest.approx(10.0)


def test_without_ranges_there_is_no_point() -> None:
    nothing = np.zeros(0)

    positions_m, _, gain = positions_from_ranges(
        np.zeros((0, 2)), nothing, nothing, np.zeros(0, np.int64), gain_sd=0.1
    )

    assert positions_m.shape == (0, 2)
    assert gain == 0.0
