"""The relative error of depth."""

from __future__ import annotations

import numpy as np

from cogmap.geometry.arrays import Singles

NEAREST_M = 3.0
FARTHEST_M = 30.0


def errors(depth_m: Singles, true_m: Singles) -> tuple[Singles, float]:
    """The relative errors (n,) where depth is known, from NEAREST_M to FARTHEST_M.

    Returns too of which share of the pixels within these limits it is known.
    """
    is_within = (true_m >= NEAREST_M) & (true_m <= FARTHEST_M)
    is_known = is_within & (depth_m > 0)

    known_m = true_m[is_known]
    error_m = np.abs(depth_m[is_known] - known_m)
    relative = error_m / known_m

    within = max(1, is_within.sum())
    share = is_known.sum() / within
    return relative.astype(np.float32, copy=False), float(share)
