"""Names that perception was taught, judged by the building that each percept shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cogmap.cli.launch.individuals.buildings import NOTHING, Buildings
from cogmap.geometry.arrays import Floats
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
    judged = []
    for view in views:
        pose = pose_at.get(view.stamp_ns)
        if pose is None:
            continue

        for percept in view.objects:
            if percept.name not in TAUGHT:
                continue

            place = (percept.bearing_rad, percept.range_m)
            building = buildings.shown_by(pose, place, percept.outline_px, view.calibration)
            is_right = building != NOTHING and buildings.names[building] == percept.name
            judged.append((percept.activation, is_right))

    return judged


def sure_right_share(judged: Sequence[tuple[float, bool]]) -> float:
    """Return the share of those with an activation over SURE that are right; NaN of none."""
    sure = [is_right for activation, is_right in judged if activation > SURE]
    return float(np.mean(sure)) if sure else float("nan")
