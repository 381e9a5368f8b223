"""Loop closures that the path explains already: a correction by these would change nothing, and
waits (beyond the paper).
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from cogmap.estimation.pairwise_consistency import MIN_AGREEING
from cogmap.estimation.pose_graph import mahalanobis2, residuals
from cogmap.geometry.arrays import Floats
from cogmap.schemas.nodes import LoopClosure
from cogmap.services.codelets.config import Config
from cogmap.services.codelets.mapping.path import POSE
from cogmap.services.codelets.mapping.views import constraints_of, views_of


def may_wait(closures: list[LoopClosure], rows: Floats, config: Config) -> bool:
    """Whether the path `rows`, as it is believed, explains all but a share of the closures, or all
    but so few that they close no loop: it is misfitted by at most `waiting_misfit`.
    """
    if not config.waiting_share:
        return False

    misfit = _misfit(closures, rows, config)
    unexplained = int((misfit > config.waiting_misfit).sum())
    return unexplained < max(MIN_AGREEING, config.waiting_share * len(closures))


def _misfit(closures: list[LoopClosure], rows: Floats, config: Config) -> Floats:
    """(m,): each closure's squared Mahalanobis distance from what the path states, over that which
    a true one exceeds with probability `false_closure`.
    """
    poses = rows[:, POSE]
    views = views_of(closures, rows)
    constraints = constraints_of(views, poses)
    squared = mahalanobis2(residuals(poses, constraints), constraints.information)

    degrees = np.where(views.has_heading, 3, 2)
    misfit: Floats = squared / chdtri(degrees, config.false_closure)
    return misfit
