"""Eq. 9 as it is printed, by hand-worked numbers (paper §5.6)."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.estimation.printed_rule import (
    LEARNING_RATE,
    REPLAYS,
    Loops,
    close_loops,
    precisions,
    replayed,
    shares,
)
from cogmap.geometry.arrays import Floats

STEP_M2 = np.full(5, 0.1)


def _loops(*ends: tuple[int, int], variance_m2: float = 0.4) -> Loops:
    """Loops whose ends are the same place."""
    a, b = np.array(ends).T
    return Loops(a, b, np.zeros((len(a), 2)), np.full(len(a), variance_m2))


def _line() -> Floats:
    """Six positions along x, 3 m apart from the second on."""
    return np.array([(0.0, 0.0), (0.0, 0.0), (3.0, 0.0), (6.0, 0.0), (9.0, 0.0), (12.0, 0.0)])


def test_positions_share_a_discrepancy_by_how_far_along_the_loop_they_lie() -> None:
    assert shares(7, 1, 5) == pytest.approx([0, 0, 0, 1 / 3, 2 / 3, 1, 1])


def test_one_replay_takes_the_share_of_eq_9_from_each_position_of_the_loop() -> None:
    # d = x_0 - x_4 = -9; p = 0, 1/3, 2/3, 1 of positions 1 to 4, and 1 beyond.
    once = replayed(_line(), _loops((0, 4)), np.array([1.0]))
    assert once[:, 0] == pytest.approx([0, 0, 0, 0, 0, 3])
    half = replayed(_line(), _loops((0, 4)), np.array([0.5]))
    assert half[:, 0] == pytest.approx([0, 0, 1.5, 3, 4.5, 7.5])


def test_positions_up_to_the_place_seen_again_stay() -> None:
    after = replayed(_line(), _loops((2, 5)), np.array([1.0]))
    assert after[:, 0] == pytest.approx([0, 0, 3, 6, 4.5, 3])


def test_what_two_views_show_of_the_distance_between_the_ends_is_no_error() -> None:
    # x_0 should lie 5 m before x_4: it lies 9 m before it, so that d = -9 + 5 = -4.
    loops = Loops(np.array([0]), np.array([4]), np.array([[-5.0, 0.0]]), np.array([0.4]))
    after = replayed(_line(), loops, np.array([1.0]))
    assert after[4, 0] == pytest.approx(5.0)


def test_each_replay_halves_what_is_left() -> None:
    after, replays = close_loops(_line(), _loops((0, 4)), STEP_M2)

    assert replays == REPLAYS
    assert after[4, 0] == pytest.approx(9 * (1 - LEARNING_RATE) ** REPLAYS)


def test_a_loop_weighs_by_its_precision_over_that_of_its_steps() -> None:
    loops = Loops(np.array([0, 1]), np.array([4, 5]), np.zeros((2, 2)), np.array([0.05, 0.2]))
    assert precisions(loops, STEP_M2) == pytest.approx([2.0, 0.5])

    # The later loop comes first: alpha A = 1/2 of its 0.5 / 2.0, that is 1/8 of its 12 m.
    one = replayed(_line(), loops, LEARNING_RATE * np.array([1.0, 0.25]))
    assert one[5, 0] == pytest.approx(10.5 - 0.5 * (9 - 1.5 * 2 / 3))


def test_a_loop_of_one_step_has_nothing_to_correct() -> None:
    after, replays = close_loops(_line(), _loops((1, 2)), STEP_M2)

    assert replays == 0
    assert after == pytest.approx(_line())
