"""Loop closures as arrays: as views from places of the path, and as constraints between these."""

from __future__ import annotations

import numpy as np

from cogmap.estimation.pairwise_consistency import Views
from cogmap.estimation.pose_graph import Constraints, matvec
from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import relative, rotation_matrices
from cogmap.schemas.nodes import LoopClosure
from cogmap.services.codelets.mapping.path import STAMP

MIN_SD_M = 1e-3


def views_of(closures: list[LoopClosure], rows: Floats) -> Views:
    """The closures as views from rows of the path."""
    places = _places_of(closures, rows)
    sd_m = np.array([closure.sd_m for closure in closures])
    sd_rad = np.array([closure.sd_rad for closure in closures])

    return Views(
        i=places[:, 0],
        j=places[:, 1],
        there_m=_there_m(closures),
        here_m=_here_m(closures),
        sd_m=sd_m.clip(MIN_SD_M),
        sd_rad=sd_rad,
    )


def _places_of(closures: list[LoopClosure], rows: Floats) -> Indices:
    """(m, 2): the rows nearest in time to where each closure leads from, and to."""
    from_to_ns = [[closure.from_ns, closure.to_ns] for closure in closures]
    stamps_ns = np.array(from_to_ns).reshape(-1, 2)
    stamps_s = stamps_ns * 1e-9

    path_s = rows[:, STAMP]
    after = path_s.searchsorted(stamps_s).clip(max=len(rows) - 1)
    before = (after - 1).clip(0)

    is_before = stamps_s - path_s[before] <= path_s[after] - stamps_s
    return np.where(is_before, before, after)


def _there_m(closures: list[LoopClosure]) -> Floats:
    """(m, 2): what was seen, forwards and left of the place before."""
    points_m = []
    for closure in closures:
        points_m.append([closure.ahead_m, closure.left_m])

    return np.array(points_m).reshape(-1, 2)


def _here_m(closures: list[LoopClosure]) -> Floats:
    """(m, 2): what is seen again, forwards and left of the later place."""
    range_m = np.array([closure.range_m for closure in closures])
    bearing_rad = np.array([closure.bearing_rad for closure in closures])

    forwards = np.cos(bearing_rad)
    left = np.sin(bearing_rad)
    direction = np.column_stack([forwards, left])
    here_m: Floats = range_m[:, None] * direction
    return here_m


def constraints_of(views: Views, poses: Floats) -> Constraints:
    """The views as constraints between (n, 3) poses, near those.

    A landmark determines the agent's position given its heading alone: with another heading the
    agent stands elsewhere around it.
    """
    origins = poses[views.i]
    step = relative(origins, poses[views.j])
    turn_rad = np.where(views.has_heading, 0.0, step[:, 2])

    turn = rotation_matrices(turn_rad)
    seen_m = matvec(turn, views.here_m)

    moved_m = views.there_m - seen_m
    measured = np.column_stack([moved_m, turn_rad])
    return Constraints(
        i=views.i,
        j=views.j,
        measurement=measured,
        information=_information(views, seen_m),
    )


def _information(views: Views, seen_m: Floats) -> Floats:
    """(m, 3, 3): the information of the views of (m, 2) points, about the place of view."""
    jacobian = _jacobian(seen_m)
    variance_m2 = views.sd_m[:, None, None] ** 2
    information: Floats = jacobian.mT @ jacobian / variance_m2

    has_heading = views.has_heading
    known_sd_rad = views.sd_rad[has_heading]
    information[has_heading, 2, 2] += known_sd_rad**-2
    return information


def _jacobian(seen_m: Floats) -> Floats:
    """(m, 2, 3): how (m, 2) points move with the pose of who sees them there."""
    jacobian = np.zeros((len(seen_m), 2, 3))
    jacobian[:, 0, 0] = 1.0
    jacobian[:, 1, 1] = 1.0

    x_m, y_m = seen_m.T
    jacobian[:, 0, 2] = -y_m
    jacobian[:, 1, 2] = x_m
    return jacobian
