from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.services.memory.matching import NOWHERE, Landmarks, best_matches

WITHIN_M = 2.5
POSE = np.array([40.0, -25.0, 1.2])


def town(seed: int, count: int = 40, looks: int = 8) -> Landmarks:
    """Buildings at random in a town of 200 m."""
    rng = np.random.default_rng(seed)
    return Landmarks(rng.integers(0, looks, count), rng.uniform(-100, 100, (count, 2)))


def seen_from(pose: Floats, there: Landmarks, count: int) -> Landmarks:
    """The first landmarks of a town, in the frame that has that pose in it."""
    return Landmarks(there.looks[:count], transform_to(pose, there.at_m[:count]))


def test_a_part_of_a_town_is_found_where_it_is() -> None:
    there = town(1)

    found = best_matches(seen_from(POSE, there, 8), there, WITHIN_M)

    assert found is not None
    match, runner_up = found
    assert match.pose == pytest.approx(POSE, abs=1e-6)
    assert match.there.tolist() == list(range(8))
    assert runner_up < 6


def test_what_is_seen_a_little_beside_its_place_is_fitted_by_all_of_it() -> None:
    there = town(2)
    here = seen_from(POSE, there, 10)
    noise_m = np.random.default_rng(3).normal(0, 0.4, here.at_m.shape)

    found = best_matches(Landmarks(here.looks, here.at_m + noise_m), there, WITHIN_M)

    assert found is not None
    match, _ = found
    assert match.matched == 10
    assert match.pose[:2] == pytest.approx(POSE[:2], abs=1.0)
    assert match.pose[2] == pytest.approx(POSE[2], abs=0.02)


def test_in_another_town_few_landmarks_stand_alike() -> None:
    found = best_matches(seen_from(POSE, town(4), 10), town(5), WITHIN_M)

    assert found is None or found[0].matched < 6


def test_no_two_landmarks_belong_to_one() -> None:
    there = Landmarks(np.array([0, 1]), np.array([[0.0, 0.0], [20.0, 0.0]]))
    here = Landmarks(np.array([0, 0, 1]), np.array([[0.0, 0.0], [0.0, 1.0], [20.0, 0.0]]))

    found = best_matches(here, there, WITHIN_M)

    assert found is not None
    belongs = found[0].there.tolist()
    assert sorted(belongs) == [NOWHERE, 0, 1]


def test_a_row_of_equal_houses_fits_as_well_one_house_further_on() -> None:
    at_m = np.column_stack([np.arange(8) * 12.0, np.zeros(8)])
    row = Landmarks(np.zeros(8, np.int64), at_m)

    found = best_matches(Landmarks(row.looks[:6], row.at_m[:6]), row, WITHIN_M)

    assert found is not None
    match, runner_up = found
    assert match.matched - runner_up <= 1


def test_landmarks_that_look_like_none_there_match_nothing() -> None:
    here = Landmarks(np.array([NOWHERE, NOWHERE]), np.array([[0.0, 0.0], [10.0, 0.0]]))

    assert best_matches(here, town(6), WITHIN_M) is None
