from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.memory.second_run import Drive, is_right, share_of_way

BEGAN = np.array([10.0, 20.0, math.pi / 2])
"""Where the first run began in the town: the origin of its map."""


def drive(driven_m: float = 100.0, recalled: str = "", **facts: object) -> Drive:
    """A drive that ends 5 m ahead of the origin of the map."""
    usual = {
        "recalled_m": 30.0,
        "believed": np.array([5.0, 0.0, 0.0]),
        "true": np.array([10.0, 25.0, math.pi / 2]),
        "began": BEGAN,
        "stored": [],
    }
    return Drive(driven_m=driven_m, recalled=recalled, **(usual | facts))  # type: ignore[arg-type]


def test_the_error_is_that_of_the_believed_pose_in_the_first_runs_frame() -> None:
    error_m, error_rad = drive(true=np.array([10.0, 28.0, math.pi / 2 + 0.1])).error(BEGAN)

    assert error_m == pytest.approx(3.0)
    assert error_rad == pytest.approx(0.1)


def test_a_map_that_is_recalled_and_right_counts_with_the_way_until_then() -> None:
    assert share_of_way(drive(300.0), drive(50.0, "town-1")) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "second",
    [
        drive(90.0),
        drive(90.0, "town-1", true=np.array([10.0, 28.0, math.pi / 2])),
        drive(90.0, "town-1", true=np.array([10.0, 25.0, 0.0])),
    ],
    ids=["not recalled", "elsewhere", "turned"],
)
def test_a_map_that_is_not_recalled_or_wrongly_counts_with_the_whole_way(second: Drive) -> None:
    assert not is_right(drive(300.0), second)
    assert share_of_way(drive(300.0), second) == pytest.approx(0.3)
