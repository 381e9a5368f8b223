"""What is believed of the agent's pose, and of where the objects stand that a percept may be of."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.se2 import compose, moved_by, wrap_angle
from cogmap.schemas.nodes import POSE_COLUMNS, Self
from cogmap.schemas.sensing import Percept

FARTHEST_M = 50.0
"""The range up to which anything may be seen: no building is recognised from farther."""

P_TRACKED = 0.5
P_DRIFTED = 0.02
"""How likely the agent stands as surely to what it sees as to what it has seen of late, and how
likely it has drifted as far as path integration has since the start."""

MAX_DRIFT_M = 3.0
MAX_TURNED_RAD = 0.3
"""With more drift no place tells things apart; then only constellations and looks do."""

MIN_VARIANCE = 1e-6
"""In square metres and radians: less than any pose is known to, so that matrices have inverses."""

BELIEVED = 1
"""Which of the three ways in which a pose is believed is as its samples are."""


class Source(IntEnum):
    """By what it is known where an object stands to the agent."""

    TRACKED = 0
    """Path integration since it was seen last."""
    MAPPED = 1
    """The map, and where the agent is on it."""


class Belief(NamedTuple):
    """A mixture of h normal distributions of the pose: means (h, 3), covariances (h, 3, 3), the
    logarithms of their weights, (h,), and which of the sources of Possible tells where things stand
    to each, (h,).
    """

    means: Floats
    covariances: Floats
    log_weights: Floats
    sources: Indices

    def take(self, rows: Indices) -> Belief:
        """Return those of these rows."""
        return Belief(
            self.means[rows], self.covariances[rows], self.log_weights[rows], self.sources[rows]
        )


class Possible(NamedTuple):
    """A percept, and the m objects that it may be of: where they stand by each of s sources,
    (s, m, 2), with the covariances of that (s, m, 2, 2), their numbers (m,), the logarithm of how
    much likelier it looks so if it is of each than of any, (m,), and that of how likely it is of
    none of them.
    """

    percept: Percept
    places_m: Floats
    own_m2: Floats
    numbers: Indices
    log_likeness: Floats
    log_none: float


def belief_of(agent: Self, motions: Floats) -> Belief:
    """Return what is believed of the agent's pose after (n, 5) `motions`, three ways: as sure as it
    is to what it has seen of late, as its samples are, and as path integration since the start is,
    for the samples may be surer than they are right.
    """
    pose = np.array([agent.x_m, agent.y_m, agent.heading_rad])
    samples = agent.samples.numpy()[:, :POSE_COLUMNS]
    offsets = samples - pose
    offsets[:, 2] = wrap_angle(offsets[:, 2])
    believed = offsets.T @ offsets / len(offsets)

    path = agent.odometry
    turned_rad2 = min(path.variance_rad2, MAX_TURNED_RAD**2)
    drifted_m2 = path.variance_m2 + turned_rad2 * (path.x_m**2 + path.y_m**2)
    drifted_m2 = min(drifted_m2, MAX_DRIFT_M**2)
    drifted = believed + np.diag([drifted_m2, drifted_m2, turned_rad2])

    moved_sd = motions[:, 3:5] * motions[:, 2:3]
    moved = np.square(moved_sd).sum(axis=0)
    step_noise = np.diag([moved[0], moved[0], moved[1]]) + np.eye(3) * MIN_VARIANCE
    mean = compose(pose, moved_by(np.zeros(3), motions))
    return Belief(
        means=np.tile(mean, (3, 1)),
        covariances=np.stack([np.zeros((3, 3)), believed, drifted]) + step_noise,
        log_weights=np.log([P_TRACKED, 1 - P_TRACKED - P_DRIFTED, P_DRIFTED]),
        sources=np.array([Source.TRACKED, Source.MAPPED, Source.MAPPED]),
    )
