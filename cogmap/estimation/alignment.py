"""Rigid alignment: the motion that brings points onto others."""

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
