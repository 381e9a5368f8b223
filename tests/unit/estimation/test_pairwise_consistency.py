"""Which views that may close a loop agree, from arrays alone."""

from __future__ import annotations

import numpy as np

from cogmap.estimation.pairwise_consistency import Views, consistent
from cogmap.geometry.se2 import rotate
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.path import steps_of
from cogmap.services.codelets.mapping.views import constraints_of

FALSE_CLOSURE = 1e-3
TOWER = np.array([30.0, 8.0])
STREET_M = np.arange(15.0) * 4.0
SECOND_PASS = 55


def _rows() -> np.ndarray:
    """A street driven along twice, with a long drive between that path integration has wrong."""
    once = np.zeros((15, 3))
    once[:, 0] = STREET_M

    between = np.full((40, 3), (100.0, 0.0, np.pi / 2))
    between[:, 1] = np.arange(40.0) * 4.0

    again = once + np.array([-35.0, 22.0, 0.0])
    poses = np.vstack([once, between, again])
    stamps = np.arange(len(poses), dtype=float)
    others = np.zeros((len(poses), 4))
    return np.column_stack([stamps, poses, poses, others])


def _views(*pairs: tuple[int, int], off_m: float = 0.0) -> Views:
    """Of the tower, from row `first` and row `second`, the last of them wrong by `off_m`."""
    count = len(pairs)
    first, second = np.array(pairs).T
    there = _tower_from(STREET_M[first])
    here = _tower_from(STREET_M[second - SECOND_PASS])
    here[-1, 1] += off_m

    return Views(first, second, there, here, np.full(count, 1.0), np.zeros(count))


def _tower_from(along_m: np.ndarray) -> np.ndarray:
    """Where the tower is from points of the street, (n, 2)."""
    across_m = np.zeros(len(along_m))
    return TOWER - np.column_stack([along_m, across_m])


def _agreeing(views: Views) -> list[bool]:
    steps = steps_of(_rows(), Config())
    agrees: list[bool] = consistent(views, steps, FALSE_CLOSURE).tolist()
    return agrees


def _around(centre_m: np.ndarray, turn_rad: float) -> np.ndarray:
    """The step (x, y, heading) from the origin round a centre, turning with it."""
    to_origin_m = rotate(-centre_m, np.array(turn_rad))
    return np.append(centre_m + to_origin_m, turn_rad)


def test_three_views_of_a_landmark_agree_whatever_the_drift_between_passes() -> None:
    views = _views((2, 57), (4, 59), (6, 61))

    assert _agreeing(views) == [True] * 3


def test_two_views_or_three_from_one_place_are_too_few() -> None:
    two = _views((2, 57), (4, 59))
    from_one_place = _views((2, 57), (4, 57), (6, 57))

    assert _agreeing(two) == [False] * 2
    assert _agreeing(from_one_place) == [False] * 3


def test_a_view_of_elsewhere_agrees_with_none_and_spoils_none() -> None:
    three_and_one = _views((2, 57), (4, 59), (6, 61), (8, 63), off_m=40.0)
    two_and_one = _views((2, 57), (4, 59), (6, 61), off_m=40.0)

    assert _agreeing(three_and_one) == [True, True, True, False]
    assert _agreeing(two_and_one) == [False] * 3


def test_without_views_none_agree() -> None:
    none = _views((2, 57), (4, 59)).select(np.zeros(2, bool))

    assert _agreeing(none) == []


def test_a_landmark_constrains_the_position_around_it_but_not_the_heading() -> None:
    views = _views((2, 57))
    made = constraints_of(views, _rows()[:, 1:4])
    information = made.information[0]
    assert np.linalg.matrix_rank(information) == 2

    # Turned on the spot it would see the tower elsewhere; moved round the tower, as it is.
    round_it = _around(views.here_m[0], 0.05)
    ahead, aside = 0.1 * np.eye(3)[:2]

    assert round_it @ information @ round_it < 1e-2
    assert ahead @ information @ ahead > 9e-3
    assert aside @ information @ aside > 9e-3
