"""Which views that may close a loop agree, from arrays alone."""

from __future__ import annotations

import numpy as np

from services.codelets.config import Config
from services.codelets.correction.pairwise_consistency import Views, consistent
from services.codelets.mapping.loop_detection import constraints_of
from services.codelets.mapping.path import steps_of

FALSE_CLOSURE = 1e-3
TOWER = np.array([30.0, 8.0])


def _rows() -> np.ndarray:
    """A street gone along twice, with a long way between that path integration has wrong."""
    once = np.column_stack([np.arange(0.0, 60.0, 4.0), np.zeros(15), np.zeros(15)])
    between = np.column_stack([np.full(40, 100.0), np.arange(40.0) * 4.0, np.full(40, np.pi / 2)])
    again = once + np.array([-35.0, 22.0, 0.0])
    poses = np.vstack([once, between, again])
    return np.column_stack(
        [np.arange(len(poses), dtype=float), poses, poses, np.zeros((len(poses), 2))]
    )


def _views(*pairs: tuple[int, int], off_m: float = 0.0) -> Views:
    """Of the tower, from row `first` and row `second`, the last of them wrong by `off_m`."""
    first, second = np.array(pairs).T
    street = np.arange(15.0) * 4.0
    there = TOWER - np.column_stack([street[first], np.zeros(len(first))])
    here = TOWER - np.column_stack([street[second - 55], np.zeros(len(first))])
    here[-1, 1] += off_m
    return Views(first, second, there, here, np.full(len(first), 1.0), np.zeros(len(first)))


def _agreeing(views: Views) -> list[bool]:
    agrees: list[bool] = consistent(views, steps_of(_rows(), Config()), FALSE_CLOSURE).tolist()
    return agrees


def test_three_views_of_a_landmark_agree_whatever_the_drift_between_passes() -> None:
    assert _agreeing(_views((2, 57), (4, 59), (6, 61))) == [True] * 3


def test_two_views_or_three_from_one_place_are_too_few() -> None:
    assert _agreeing(_views((2, 57), (4, 59))) == [False] * 2
    assert _agreeing(_views((2, 57), (4, 57), (6, 57))) == [False] * 3


def test_a_view_of_elsewhere_agrees_with_none_and_spoils_none() -> None:
    assert _agreeing(_views((2, 57), (4, 59), (6, 61), (8, 63), off_m=40.0)) == [
        True,
        True,
        True,
        False,
    ]
    assert _agreeing(_views((2, 57), (4, 59), (6, 61), off_m=40.0)) == [False] * 3


def test_without_views_none_agree() -> None:
    assert _agreeing(_views((2, 57), (4, 59)).select(np.zeros(2, bool))) == []


def test_a_landmark_constrains_the_position_around_it_but_not_the_heading() -> None:
    views = _views((2, 57))
    made = constraints_of(views, _rows()[:, 1:4])
    away = np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])

    assert np.linalg.matrix_rank(made.information[0]) == 2

    # Turned on the spot it would see the tower elsewhere; gone round the tower, as it is.
    turn = 0.05
    cos = np.cos(turn)
    sin = np.sin(turn)
    off = views.here_m[0]
    round_it = np.append(
        off - np.array([cos * off[0] - sin * off[1], sin * off[0] + cos * off[1]]), turn
    )

    assert round_it @ made.information[0] @ round_it < 1e-2
    assert all(step @ made.information[0] @ step > 9e-3 for step in away)
