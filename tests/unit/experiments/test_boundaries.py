"""Which lines cross a boundary."""

import numpy as np

from cogmap.experiments.map_structure.boundaries import Boundaries


def line(x0, y0, x1, y1):
    return [[x0, y0], [x1, y1]]


def test_a_line_crosses_a_boundary_that_it_meets_and_no_other():
    boundaries = Boundaries(np.array([line(0, -5, 0, 5), line(40, 0, 50, 10)], float))
    lines = np.array(
        [line(-1, 0, 1, 0), line(-1, 6, 1, 6), line(1, 0, 9, 0), line(40, 8, 50, 2)], float
    )

    assert boundaries.are_crossed(lines).tolist() == [True, False, False, True]


def test_a_long_boundary_among_short_ones_is_crossed_everywhere():
    short = [line(x, 50, x + 1, 50) for x in range(40)]
    boundaries = Boundaries(np.array([*short, line(0, 0, 1000, 0)], float))
    lines = np.array([line(x, -1, x, 1) for x in range(5, 1000, 45)], float)

    assert boundaries.are_crossed(lines).all()


def test_a_crossing_near_an_end_that_is_kept_clear_does_not_count():
    boundaries = Boundaries(np.array([line(2, -5, 2, 5)], float))
    lines = np.array([line(0, 0, 10, 0), line(10, 0, 0, 0), line(0, 0, 10, 0)], float)
    clear_m = np.array([[3.0, 0.0], [0.0, 3.0], [1.0, 3.0]])

    assert boundaries.are_crossed(lines, clear_m).tolist() == [False, False, True]


def test_without_boundaries_nothing_is_crossed():
    lines = np.array([line(0, 0, 10, 0)], float)

    assert Boundaries(np.zeros((0, 2, 2))).are_crossed(lines).tolist() == [False]
