"""How far depth is off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

NEAREST_M = 3.0
FARTHEST_M = 30.0
Floats32 = npt.NDArray[np.float32]


def errors(depth_m: Floats32, true_m: Floats32) -> tuple[Floats32, float]:
    """The relative errors where depth is known, from NEAREST_M to FARTHEST_M, and the share of
    these that is.
    """
    asked = (true_m >= NEAREST_M) & (true_m <= FARTHEST_M)
    known = asked & (depth_m > 0)
    off = np.abs(depth_m[known] - true_m[known]) / true_m[known]
    return off.astype(np.float32, copy=False), float(known.sum() / max(1, asked.sum()))
