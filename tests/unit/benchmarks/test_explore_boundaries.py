"""How the links of a map are compared with the true kerbs and walls."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.explore.boundaries import boundary_score
from cogmap.graph.window import EVIDENCE_COLUMNS, WEIGHT_COLUMNS, Window

SIDE = 12
ORIGIN = (-2, 3)
# A wall along x, half way between the rows of place nodes at y = 8 and y = 9.
WALL_M = np.array([[-4.0, 8.5, 12.0, 8.5]])
NORTHWARD = (1, 2, 3)
BEFORE_WALL = 8 - ORIGIN[1]


def _window(cut_row: int | None, known_rows: slice = slice(None)) -> Window:
    """A map, known in some rows, of which the links that lead north from one row are cut."""
    values = np.ones((8, SIDE, SIDE), np.float32)
    values[4:] = 0.0
    values[4:, :, known_rows] = 2.0
    if cut_row is not None:
        values[NORTHWARD, :, cut_row] = 0.0

    return Window(ORIGIN, (*WEIGHT_COLUMNS, *EVIDENCE_COLUMNS), values)


def test_links_cut_at_a_wall_are_right_and_miss_none() -> None:
    score = boundary_score(_window(BEFORE_WALL), 1.0, WALL_M)

    assert score.cut == 3 * SIDE
    assert score.crossed >= 3 * SIDE - 2
    assert (score.precision, score.recall) == (1.0, 1.0)


def test_links_cut_a_cell_beside_a_wall_are_right_and_farther_ones_wrong() -> None:
    beside = boundary_score(_window(BEFORE_WALL + 1), 1.0, WALL_M)
    assert (beside.precision, beside.recall) == (1.0, 1.0)

    farther = boundary_score(_window(BEFORE_WALL + 2), 1.0, WALL_M)
    assert (farther.precision, farther.recall) == (0.0, 0.0)


def test_a_wall_in_unknown_ground_is_not_missed() -> None:
    elsewhere = _window(None, known_rows=slice(0, 3))
    score = boundary_score(elsewhere, 1.0, WALL_M)

    assert (score.cut, score.crossed) == (0, 0)
    assert np.isnan([score.precision, score.recall]).all()


def test_a_wall_that_was_not_found_is_missed() -> None:
    score = boundary_score(_window(None), 1.0, WALL_M)

    assert score.crossed > 0
    assert score.recall == 0.0


@pytest.mark.parametrize("cell_m", [0.5, 4.0])
def test_walls_are_compared_in_metres(cell_m: float) -> None:
    score = boundary_score(_window(BEFORE_WALL), cell_m, WALL_M * cell_m)

    assert (score.precision, score.recall) == (1.0, 1.0)
