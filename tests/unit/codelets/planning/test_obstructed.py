"""Where something stands, by how much each place is an obstacle."""

from __future__ import annotations

import numpy as np

from cogmap.services.codelets.planning.ground import is_obstructed


def _barrier(share: float) -> np.ndarray:
    """Make a map of 12 x 12 places with a barrier in row 5, in columns 2 to 9."""
    obstacle = np.zeros((12, 12), np.float32)
    obstacle[5, 2:10] = share
    return obstacle


def test_a_barrier_that_is_seen_from_far_stands_as_a_whole() -> None:
    is_there = is_obstructed(_barrier(0.25))

    assert is_there[5, 2:10].all()
    assert is_there.sum() == 8


def test_the_rest_of_a_barrier_counts_when_a_part_of_it_is_sure() -> None:
    obstacle = _barrier(0.2)
    obstacle[5, 2:5] = 0.6

    assert is_obstructed(obstacle)[5, 2:10].all()


def test_a_few_doubtful_places_are_no_obstacle() -> None:
    obstacle = np.zeros((12, 12), np.float32)
    obstacle[3:5, 3:5] = 0.3
    obstacle[8, 8] = 0.5

    is_there = is_obstructed(obstacle)
    assert is_there[8, 8]
    assert is_there.sum() == 1


def test_much_that_is_hardly_seen_is_no_obstacle() -> None:
    assert not is_obstructed(np.full((12, 12), 0.1, np.float32)).any()
