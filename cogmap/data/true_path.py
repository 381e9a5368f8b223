"""Where a robot really was, between the times at which that was measured."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Floats

MAX_GAP_S = 0.5
"""Between two true poses that are farther apart nobody knows where the robot was."""


def poses_at(truth: Floats, stamps_s: Floats) -> Floats:
    """Interpolate (m, 4) rows in order of time, stamp in s, x_m, y_m and heading_rad, at (n,)
    stamps: (n, 3), NaN outside of the rows and in gaps above MAX_GAP_S.
    """
    known_s, x_m, y_m, heading_rad = truth.T
    columns = [np.interp(stamps_s, known_s, each) for each in (x_m, y_m, np.unwrap(heading_rad))]
    poses = np.column_stack(columns)

    last = len(known_s) - 1
    after = np.searchsorted(known_s, stamps_s).clip(min(1, last), last)
    gap_s = known_s[after] - known_s[(after - 1).clip(0)]
    is_inside = (stamps_s >= known_s[0]) & (stamps_s <= known_s[-1])
    poses[~is_inside | (gap_s > MAX_GAP_S)] = np.nan
    return poses
