"""Where objects stand to the agent by path integration since each was seen last. Pure.

The map tells where an object stands no better than where the agent is. What was seen a moment ago
stands to the agent as it was seen, however lost the agent is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative, rotation_matrices, transform_from
from cogmap.schemas.nodes import Object, Self, Sighting

MIN_RANGE_M = 1e-3
"""Nothing is seen from nearer; directions stay defined."""


def tracked(nodes: Sequence[Object], agent: Self, believed: Floats) -> tuple[Floats, Floats]:
    """Return where m objects stand to the agent, (m, 2), as places on the map if the agent's mean
    pose is right, and the covariances of that, (m, 2, 2): by how each was seen last, or by the map
    where that tells it better. `believed` (3, 3) is the covariance of the pose on the map.
    """
    places_m = np.zeros((len(nodes), 2))
    covariances_m2 = np.zeros((len(nodes), 2, 2))
    pose = np.array([agent.x_m, agent.y_m, agent.heading_rad])

    for row, node in enumerate(nodes):
        place_m = np.array([node.x_m, node.y_m])
        away_m2 = float(np.square(place_m - pose[:2]).sum())
        error_m2 = believed[0, 0] + believed[1, 1] + believed[2, 2] * away_m2
        covariance_m2 = node.covariance_m2() + error_m2 / 2 * np.eye(2)

        if node.last_sighting is not None:
            seen_m, seen_m2 = _seen_last(node.last_sighting, agent, pose)
            if np.trace(seen_m2) < np.trace(covariance_m2):
                place_m, covariance_m2 = seen_m, seen_m2

        places_m[row] = place_m
        covariances_m2[row] = covariance_m2

    return places_m, covariances_m2


def _seen_last(seen: Sighting, agent: Self, pose: Floats) -> tuple[Floats, Floats]:
    """Return where something stands to the agent at `pose` (3,) by how it was seen last, (2,), and
    the covariance of that, (2, 2): that of the sighting, and of path integration since.
    """
    now = agent.odometry.pose()
    ahead_m, left_m, _ = relative(now, np.array([seen.x_m, seen.y_m, 0.0])).tolist()
    place_m = transform_from(pose, np.array([ahead_m, left_m]))

    line_m = np.array([seen.x_m, seen.y_m]) - seen.odometry.pose()[:2]
    range_m = max(float(np.hypot(*line_m)), MIN_RANGE_M)
    step = np.array([0.0, 0.0, np.arctan2(line_m[1], line_m[0]) - now[2]])
    turn = rotation_matrices(compose(pose, step)[2])
    across_sd_m = range_m * seen.bearing_sd_rad
    covariance_m2 = turn @ np.diag([seen.range_sd_m**2, across_sd_m**2]) @ turn.T

    since_m2, since_rad2 = (agent.odometry.variances() - seen.odometry.variances()).tolist()
    drift_m2 = since_m2 + since_rad2 * (ahead_m**2 + left_m**2) / 2
    return place_m, covariance_m2 + max(drift_m2, 0.0) * np.eye(2)
