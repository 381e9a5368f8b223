from __future__ import annotations

import math

import numpy as np
import pytest

from cogmap.geometry.arctangent import arctan2

LARGEST_ERROR_RAD = 1e-6


def test_the_angles_of_vectors_all_around_are_exact_to_a_microradian() -> None:
    exact_rad = np.linspace(-math.pi + 1e-3, math.pi, 10_001)
    length_m = np.geomspace(1e-3, 1e4, 10_001)
    y = (length_m * np.sin(exact_rad)).astype(np.float32)
    x = (length_m * np.cos(exact_rad)).astype(np.float32)

    exact_rad = np.arctan2(y.astype(np.float64), x.astype(np.float64))
    assert np.abs(arctan2(y, x) - exact_rad).max() < LARGEST_ERROR_RAD


@pytest.mark.parametrize(
    ("x", "y", "angle_rad"),
    [
        (0.0, 0.0, 0.0),
        (2.0, 0.0, 0.0),
        (0.0, 2.0, math.pi / 2),
        (-2.0, 0.0, math.pi),
        (0.0, -2.0, -math.pi / 2),
        (-2.0, -2.0, -3 * math.pi / 4),
    ],
)
def test_the_angle_of_a_vector_along_an_axis_is_that_of_the_axis(
    x: float, y: float, angle_rad: float
) -> None:
    found = arctan2(np.array([y], np.float32), np.array([x], np.float32))

    assert found.tolist() == pytest.approx([angle_rad], abs=LARGEST_ERROR_RAD)
