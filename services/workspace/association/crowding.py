"""How likely something that is not known stands where a percept is seen: things stand in groups.

Half of what is new stands anywhere in view. The other half stands beside another thing, at a
distance that is known to no order of magnitude: its logarithm is uniform. So where two things are
seen close together they are no proof of two others that stand so too. Pure.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Percept
from cogmap.services.workspace.association.beliefs import FARTHEST_M, Belief, Possible

NEAREST_M = 0.05
"""Things that are seen apart stand so far apart at least."""

LOG_SCALES = float(np.log(FARTHEST_M / NEAREST_M))


def log_crowding(percept: Percept, nearest_m2: Floats) -> Floats:
    """Return the logarithm of how much likelier something new is seen where a percept is than
    anywhere in view, (h,), if the nearest other thing stands at a squared distance, (h,). It is 0
    if nothing stands near, or its place is not known.
    """
    if not percept.has_place:
        return np.zeros(len(nearest_m2))

    beside = FARTHEST_M * percept.range_m / (nearest_m2.clip(NEAREST_M**2) * LOG_SCALES)
    return np.asarray(np.log(((1 + beside) / 2).clip(1.0)))


def nearest_known_m2(belief: Belief, possible: Possible) -> Floats:
    """Return the expected squared distance to the nearest of the objects that a percept may be of,
    (h,), from each of the belief's h distributions of the pose; at most FARTHEST_M squared.
    """
    percept = possible.percept
    if not len(possible.numbers) or not percept.has_place:
        return np.full(len(belief.means), FARTHEST_M**2)

    directions_rad = belief.means[:, 2] + percept.bearing_rad
    towards = np.column_stack([np.cos(directions_rad), np.sin(directions_rad)])
    at_m = belief.means[:, :2] + percept.range_m * towards
    turned_m2 = percept.range_m**2 * belief.covariances[:, 2, 2]
    moved_m2 = belief.covariances[:, 0, 0] + belief.covariances[:, 1, 1] + turned_m2

    away_m2 = np.square(at_m[:, None] - possible.places_m[belief.sources]).sum(axis=2)
    away_m2 += np.trace(possible.own_m2[belief.sources], axis1=2, axis2=3)
    nearest_m2: Floats = away_m2.min(axis=1) + moved_m2 + _variance_m2(percept)
    return nearest_m2.clip(max=FARTHEST_M**2)


def nearest_seen_m2(percept: Percept, others: Sequence[Percept]) -> float:
    """Return the expected squared distance to the nearest of other percepts of the same view; at
    most FARTHEST_M squared.
    """
    nearest_m2 = FARTHEST_M**2
    for other in others:
        if not (percept.has_place and other.has_place):
            continue

        apart_rad = percept.bearing_rad - other.bearing_rad
        apart_m2 = percept.range_m**2 + other.range_m**2
        apart_m2 -= 2 * percept.range_m * other.range_m * float(np.cos(apart_rad))
        nearest_m2 = min(nearest_m2, apart_m2 + _variance_m2(percept) + _variance_m2(other))

    return nearest_m2


def _variance_m2(percept: Percept) -> float:
    """Return the variance of where a percept is seen, along and across the line of sight."""
    return percept.range_sd_m**2 + (percept.range_m * percept.bearing_sd_rad) ** 2
