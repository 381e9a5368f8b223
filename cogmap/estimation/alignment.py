"""Alignment: the motion that brings points onto others, and their likeness to them."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import rotate


def motion_onto(
    points_m: Floats,
    others_m: Floats,
    weights: Floats | None = None,
    unturned_information: float = 0.0,
) -> Floats:
    """Fit the pose (3,) that moves (k, 2) points onto others with the least squares (Umeyama 1991),
    each point counted by its weight (k,).

    `unturned_information`, in rad^-2, is the information of a prior that the points do not turn.
    """
    each = np.ones(len(points_m)) if weights is None else weights
    middle_m = each @ points_m / each.sum()
    other_middle_m = each @ others_m / each.sum()
    x, y = (points_m - middle_m).T
    u, v = (others_m - other_middle_m).T

    across = each @ (x * v - y * u)
    along = each @ (x * u + y * v) + unturned_information
    turn_rad = np.arctan2(across, along)
    shift_m = other_middle_m - rotate(middle_m, turn_rad)
    return np.array([*shift_m, turn_rad])


def similar_to(points_m: Floats, others_m: Floats) -> Floats:
    """Turn, move and scale (k, 2) points onto others with the least squares (Procrustes), without
    mirroring them. Return them. Points that are all at one place come to the others' middle.
    """
    middle_m = points_m.mean(axis=0)
    other_middle_m = others_m.mean(axis=0)
    points = (points_m - middle_m) @ (1, 1j)
    others = (others_m - other_middle_m) @ (1, 1j)

    # As complex numbers, a turn with a scale is a factor.
    extent = np.vdot(points, points).real
    factor = np.vdot(points, others) / extent if extent > 0 else 0.0
    found = factor * points
    return np.asarray(other_middle_m + np.column_stack([found.real, found.imag]))
