"""Loop closures that join what is not the same, by the truth."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from cogmap.cli.launch.individuals.buildings import NOTHING, Buildings
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.nodes import LoopClosure

APART_M = 6.0
"""More than a closure by a place, or by a landmark's middle, errs by; less than two places of a
street that look alike are apart.
"""


def wrong_closures(
    closures: Iterable[LoopClosure], pose_at: dict[int, Floats], buildings: Buildings
) -> tuple[int, int]:
    """Count the closures that were accepted, and those of them that are wrong: they join two
    buildings, or two places farther apart than APART_M. `pose_at` has the true poses (3,) by stamp.
    """
    accepted = [each for each in closures if each.accepted]
    wrong = 0
    for closure in accepted:
        then = pose_at[_nearest(pose_at, closure.from_ns)]
        now = pose_at[_nearest(pose_at, closure.to_ns)]
        there_m = transform_from(then, np.array([[closure.ahead_m, closure.left_m]]))
        ahead_m = closure.range_m * math.cos(closure.bearing_rad)
        left_m = closure.range_m * math.sin(closure.bearing_rad)
        here_m = transform_from(now, np.array([[ahead_m, left_m]]))
        is_place = closure.sd_rad > 0
        one, other = buildings.shown_at(np.vstack([there_m, here_m])).tolist()
        if not is_place and NOTHING not in (one, other):
            wrong += one != other
        else:
            wrong += math.dist(there_m[0], here_m[0]) > APART_M

    return len(accepted), wrong


def _nearest(pose_at: dict[int, Floats], stamp_ns: int) -> int:
    if stamp_ns in pose_at:
        return stamp_ns
    return min(pose_at, key=lambda known_ns: abs(known_ns - stamp_ns))
