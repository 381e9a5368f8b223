"""Defers a correction by loop closures that the path explains already: it would change nothing
(beyond the paper).
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from cogmap.estimation.pairwise_consistency import MIN_AGREEING
from cogmap.estimation.pose_graph import mahalanobis2, residuals
from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import LoopClosure
from cogmap.services.codelets.mapping.path import POSE
from cogmap.services.codelets.mapping.views import constraints_of, views_of

# A loop closure is rejected if a true one would misfit as much with a smaller probability.
FALSE_CLOSURE = 1e-3
# The path explains a closure whose misfit is at most this share of that at which it is rejected.
EXPLAINED_MISFIT = 0.1
# The path is corrected from this share of new closures on that it does not explain.
UNEXPLAINED_SHARE = 0.1


def may_be_deferred(closures: list[LoopClosure], rows: Floats) -> bool:
    """If the path `rows`, as it is believed, explains all but a share of the closures, or all but
    so few that they close no loop.
    """
    poses = rows[:, POSE]
    views = views_of(closures, rows)
    constraints = constraints_of(views, poses)
    squared = mahalanobis2(residuals(poses, constraints), constraints.information)

    degrees = np.where(views.has_heading, 3, 2)
    misfit = squared / chdtri(degrees, FALSE_CLOSURE)
    unexplained = int((misfit > EXPLAINED_MISFIT).sum())
    return unexplained < max(MIN_AGREEING, UNEXPLAINED_SHARE * len(closures))
