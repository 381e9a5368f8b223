"""Where objects stand to the agent by path integration since each was seen last. Pure.

The map tells where an object stands no better than where the agent is. What was seen a moment ago
stands to the agent as it was seen, however lost the agent is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import compose, relative, rotation_matrices
from cogmap.schemas.nodes import Object, Self, Sighting

MIN_RANGE_M = 1e-3
"""Nothing is seen from nearer; directions stay defined."""


class Places(NamedTuple):
    """Where m objects stand, (m, 2), and the covariances of that, (m, 2, 2)."""

    mean_m: Floats
    covariance_m2: Floats


def mapped(nodes: Sequence[Object]) -> Places:
    """Return where the map has objects."""
    mean_m = np.array([(node.x_m, node.y_m) for node in nodes]).reshape(-1, 2)
    covariance_m2 = np.array([node.covariance_m2() for node in nodes]).reshape(-1, 2, 2)
    return Places(mean_m, covariance_m2)


def tracked(nodes: Sequence[Object], on_map: Places, agent: Self, believed: Floats) -> Places:
    """Return where objects stand to the agent, as places on the map if the agent's mean pose is
    right: by how each was seen last, or as they are `on_map` where that tells it better. `believed`
    (3, 3) is the covariance of the pose on the map.
    """
    pose = np.array([agent.x_m, agent.y_m, agent.heading_rad])
    away_m2 = np.square(on_map.mean_m - pose[:2]).sum(axis=1)
    error_m2 = believed[0, 0] + believed[1, 1] + believed[2, 2] * away_m2
    mean_m = on_map.mean_m.copy()
    covariance_m2 = on_map.covariance_m2 + error_m2[:, None, None] / 2 * np.eye(2)

    sightings = [(row, node.last_sighting) for row, node in enumerate(nodes)]
    seen = [(row, sighting) for row, sighting in sightings if sighting is not None]
    if not seen:
        return Places(mean_m, covariance_m2)

    rows = np.array([row for row, _ in seen])
    last = _seen_last([sighting for _, sighting in seen], agent, pose)
    last_m2 = np.trace(last.covariance_m2, axis1=1, axis2=2)
    is_better = last_m2 < np.trace(covariance_m2[rows], axis1=1, axis2=2)
    mean_m[rows[is_better]] = last.mean_m[is_better]
    covariance_m2[rows[is_better]] = last.covariance_m2[is_better]
    return Places(mean_m, covariance_m2)


def _seen_last(sightings: Sequence[Sighting], agent: Self, pose: Floats) -> Places:
    """Return where things stand to the agent at `pose` (3,) by how each was seen last; the
    covariance is that of the sighting, and of path integration since.
    """
    now = agent.odometry
    columns = [
        (
            seen.x_m,
            seen.y_m,
            seen.odometry.x_m,
            seen.odometry.y_m,
            seen.range_sd_m,
            seen.bearing_sd_rad,
            now.variance_m2 - seen.odometry.variance_m2,
            now.variance_rad2 - seen.odometry.variance_rad2,
        )
        for seen in sightings
    ]
    numbers = np.array(columns)
    where_m, from_m = numbers[:, :2], numbers[:, 2:4]
    range_sd_m, bearing_sd_rad, since_m2, since_rad2 = numbers[:, 4:].T

    line_m = where_m - from_m
    range_m = np.hypot(line_m[:, 0], line_m[:, 1]).clip(MIN_RANGE_M)
    direction_rad = np.arctan2(line_m[:, 1], line_m[:, 0])
    step = relative(now.pose(), np.column_stack([where_m, direction_rad]))
    there = compose(pose, step)

    turn = rotation_matrices(there[:, 2])
    variances_m2 = np.square(np.column_stack([range_sd_m, range_m * bearing_sd_rad]))
    covariance_m2 = turn * variances_m2[:, None, :] @ turn.mT
    drift_m2 = since_m2 + since_rad2 * np.square(step[:, :2]).sum(axis=1) / 2
    drifted_m2 = drift_m2.clip(0.0)[:, None, None] * np.eye(2)
    return Places(there[:, :2], covariance_m2 + drifted_m2)
