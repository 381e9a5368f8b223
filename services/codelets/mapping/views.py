"""Loop closures as arrays: as views from places of the path, and as constraints between these."""

from __future__ import annotations

import numpy as np

from cogmap.estimation.pairwise_consistency import Views
from cogmap.estimation.pose_graph import Constraints, matvec
from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import relative, rotation_matrices
from cogmap.schemas.nodes import LoopClosure
from cogmap.services.codelets.mapping.path import STAMP

# Less than any sense is exact to: weights stay finite.
MIN_SD_M = 1e-3


def views_of(closures: list[LoopClosure], rows: Floats) -> Views:
    """Convert the closures to views from rows of the path, those nearest in time."""
    stamps_s = np.array([[each.from_ns, each.to_ns] for each in closures]).reshape(-1, 2) * 1e-9
    path_s = rows[:, STAMP]
    after = path_s.searchsorted(stamps_s).clip(max=len(rows) - 1)
    before = (after - 1).clip(0)
    is_before = stamps_s - path_s[before] <= path_s[after] - stamps_s
    places = np.where(is_before, before, after)

    there_m = np.array([[each.ahead_m, each.left_m] for each in closures]).reshape(-1, 2)
    range_m = np.array([each.range_m for each in closures])
    bearing_rad = np.array([each.bearing_rad for each in closures])
    direction = np.column_stack([np.cos(bearing_rad), np.sin(bearing_rad)])
    return Views(
        i=places[:, 0],
        j=places[:, 1],
        there_m=there_m,
        here_m=range_m[:, None] * direction,
        sd_m=np.array([each.sd_m for each in closures]).clip(MIN_SD_M),
        sd_rad=np.array([each.sd_rad for each in closures]),
    )


def constraints_of(views: Views, poses: Floats) -> Constraints:
    """Convert the views to constraints between (n, 3) poses, near those.

    A landmark determines the agent's position given its heading alone: with another heading the
    agent stands elsewhere around it.
    """
    step = relative(poses[views.i], poses[views.j])
    turn_rad = np.where(views.has_heading, 0.0, step[:, 2])
    seen_m = matvec(rotation_matrices(turn_rad), views.here_m)

    # How what is seen moves with the pose of who sees it.
    jacobian = np.zeros((len(seen_m), 2, 3))
    jacobian[:, 0, 0] = 1.0
    jacobian[:, 1, 1] = 1.0
    jacobian[:, 0, 2] = -seen_m[:, 1]
    jacobian[:, 1, 2] = seen_m[:, 0]
    information = jacobian.mT @ jacobian / views.sd_m[:, None, None] ** 2
    information[views.has_heading, 2, 2] += views.sd_rad[views.has_heading] ** -2
    return Constraints(
        i=views.i,
        j=views.j,
        measurement=np.column_stack([views.there_m - seen_m, turn_rad]),
        information=information,
    )
