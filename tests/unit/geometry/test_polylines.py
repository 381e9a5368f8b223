"""Polylines: lengths, points along them, the nearest point."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.geometry import polylines

LINE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])


def test_distances_along_a_line_add_up_its_pieces() -> None:
    assert polylines.distances_along(LINE).tolist() == [0.0, 4.0, 7.0]


def test_points_beyond_the_ends_of_a_line_are_its_ends() -> None:
    along_m = np.array([-1.0, 5.0, 9.0])
    points = polylines.points_at(LINE, along_m)

    assert points.tolist() == [[0.0, 0.0], [4.0, 1.0], [4.0, 3.0]]


def test_a_resampled_line_has_evenly_spaced_points() -> None:
    points = polylines.resample(LINE, 2.0)

    assert points.tolist() == [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 2.0]]


def test_the_nearest_point_lies_on_the_nearest_piece() -> None:
    points = np.array([[1.0, -2.0], [6.0, 2.0], [9.0, 9.0]])
    nearest = polylines.nearest_on_line(LINE, points)

    assert nearest.piece.tolist() == [0, 1, 1]
    assert nearest.foot_m.tolist() == [[1.0, 0.0], [4.0, 2.0], [4.0, 3.0]]


def test_many_points_are_searched_in_parts_with_the_same_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-5.0, 5.0, (50, 2))
    whole = polylines.nearest_on_line(LINE, points)

    monkeypatch.setattr(polylines, "CHUNK", 7)
    parts = polylines.nearest_on_line(LINE, points)

    assert np.array_equal(parts.piece, whole.piece)
    assert np.array_equal(parts.foot_m, whole.foot_m)


def test_no_points_have_no_nearest() -> None:
    none = np.empty((0, 2))
    nearest = polylines.nearest_on_line(LINE, none)

    assert nearest.foot_m.shape == (0, 2)


def test_a_piece_without_length_is_a_point() -> None:
    corner = LINE[:1]
    nearest = polylines.nearest_on_pieces(corner, corner, np.array([[3.0, 4.0]]))

    assert nearest.foot_m.tolist() == [[0.0, 0.0]]
