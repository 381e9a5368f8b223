"""The absolute trajectory error, by evo (Grupp 2017)."""

from __future__ import annotations

import numpy as np

from benchmarks.optional import REMEDY
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Floats

UNTURNED_WXYZ = (1.0, 0.0, 0.0, 0.0)


def trajectory_error_m(positions_m: Floats, truth_m: Floats) -> float:
    """Root mean square distance of (n, 2) positions from the true ones, once aligned with them.

    Aligned in the plane, by a rotation and a translation (Umeyama 1991); the scale stays. Raises
    UsageError if evo is not installed.
    """
    try:
        from evo.core.geometry import umeyama_alignment
        from evo.core.metrics import APE, PoseRelation, StatisticsType
        from evo.core.trajectory import PosePath3D
    except ImportError:
        raise UsageError(f"evo {REMEDY}") from None

    rotation, translation_m, _ = umeyama_alignment(positions_m.T, truth_m.T, with_scale=False)
    aligned_m = positions_m @ rotation.T + translation_m

    # The error is of positions: headings are left out.
    orientations = np.tile(UNTURNED_WXYZ, (len(truth_m), 1))
    truth = PosePath3D(_in_space(truth_m), orientations)
    aligned = PosePath3D(_in_space(aligned_m), orientations)

    error = APE(PoseRelation.translation_part)
    error.process_data((truth, aligned))
    return float(error.get_statistic(StatisticsType.rmse))


def _in_space(positions_m: Floats) -> Floats:
    """(n, 2) positions as (n, 3), on the ground."""
    heights_m = np.zeros(len(positions_m))
    return np.column_stack([positions_m, heights_m])
