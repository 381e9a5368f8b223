"""Names that perception was taught, judged by the building that each percept shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cogmap.cli.launch.individuals.buildings import NOTHING, Buildings
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.sensing import Percepts
from cogmap.services.sim.public import CATALOGUE

TAUGHT = frozenset(kind.name for kind in CATALOGUE)
SURE = 0.9


def judged_names(
    views: Sequence[Percepts], pose_at: Mapping[int, Floats], buildings: Buildings
) -> list[tuple[float, bool]]:
    """Return the activation of each percept with a taught name, and whether it is right: whether
    the building that it shows is called so. What shows no building has no right name.
    """
    claims = []
    points_m = []
    for view in views:
        pose = pose_at.get(view.stamp_ns)
        if pose is None:
            continue

        for percept in view.objects:
            if percept.name in TAUGHT:
                direction = np.array([np.cos(percept.bearing_rad), np.sin(percept.bearing_rad)])
                points_m.append(transform_from(pose, percept.range_m * direction[None])[0])
                claims.append((percept.name, percept.activation))

    shown = buildings.shown_at(np.array(points_m).reshape(-1, 2))
    judged = []
    for (name, activation), building in zip(claims, shown.tolist(), strict=True):
        is_right = building != NOTHING and buildings.names[building] == name
        judged.append((activation, is_right))

    return judged


def sure_right_share(judged: Sequence[tuple[float, bool]]) -> float:
    """Return the share of those with an activation over SURE that are right; NaN of none."""
    sure = [is_right for activation, is_right in judged if activation > SURE]
    return float(np.mean(sure)) if sure else float("nan")
