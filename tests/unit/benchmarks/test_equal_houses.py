from __future__ import annotations

import numpy as np
import pytest

from benchmarks.memory.equal_houses import Walk, is_right
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import relative

FIRST = np.array([10.0, 20.0, 0.5])
SECOND = np.array([40.0, -5.0, 2.5])


def walk(frame: Floats) -> Walk:
    """A walk that begins in that frame, past nothing."""
    none_m = np.zeros((0, 2))
    return Walk(frame, none_m, [], none_m, np.zeros(0))


@pytest.mark.parametrize(
    ("beside", "expected"),
    [((0.0, 0.0, 0.0), True), ((12.0, 0.0, 0.0), False), ((0.0, 0.0, 3.0), False)],
    ids=["right", "a house further on", "turned round"],
)
def test_a_recalled_pose_is_right_where_the_second_walk_began(
    beside: tuple[float, float, float], expected: bool
) -> None:
    pose = relative(FIRST, SECOND) + np.array(beside)

    assert is_right(pose, walk(FIRST), walk(SECOND)) == expected


def test_what_was_seen_so_far_is_known() -> None:
    at_m = np.array([[10.0, 8.0], [60.0, 8.0], [30.0, 8.0]])
    seen = Walk(FIRST, np.zeros((100, 2)), ["house", "works", "house"], at_m, np.array([0, 40, 20]))

    assert [node.name for node in seen.objects(20)] == ["house", "house"]
    assert len(seen.objects(40)) == 3
