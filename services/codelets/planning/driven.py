"""Where the agent drove, what it takes for road just ahead, and the way back onto the road."""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from cogmap.geometry.arrays import Booleans, Floats
from cogmap.schemas.nodes import PathColumn, Self
from cogmap.services.codelets.planning.config import Config
from cogmap.services.codelets.planning.network import SQUARE, Here

BLIND_STEP_M = 0.5
LEFT_START_M = 3.0
# Where the agent drove so lately it can drive back, whatever stands there by now.
CAME_S = 60.0
ROAD_BEYOND_M = 2.0
POSITION = slice(PathColumn.X_M, PathColumn.Y_M + 1)


def driven_lately_m(path: Floats, agent: Self, ago_s: float) -> Floats:
    """(n, 2): where the agent was since so many seconds ago, and is."""
    since_s = agent.stamp_ns * 1e-9 - ago_s
    is_late = path[:, PathColumn.LAST_S] >= since_s
    here_m = np.array([[agent.x_m, agent.y_m]])
    return np.vstack([path[is_late, POSITION], here_m])


def driven_since_start_m(path_m: Floats) -> Floats:
    """The places of a path from where it has left its start: from there the agent did not look
    round.
    """
    from_start_m = np.hypot(*(path_m - path_m[:1]).T)
    has_left = from_start_m > LEFT_START_M
    since_m: Floats = path_m[has_left.cumsum() > 0]
    return since_m


def ahead_m(agent: Self, first_m: float, last_m: float) -> Floats:
    """(n, 2): positions ahead of the agent, at distances from `first_m` to before `last_m`."""
    distance_m = np.arange(first_m, last_m, BLIND_STEP_M)
    direction = np.array([math.cos(agent.heading_rad), math.sin(agent.heading_rad)])
    positions_m: Floats = np.array([agent.x_m, agent.y_m]) + distance_m[:, None] * direction
    return positions_m


def is_road_ahead(
    agent: Self, path_m: Floats, is_road: Booleans, here: Here, config: Config
) -> bool:
    """Whether the ground ahead that the agent's camera does not see is taken for road: where road
    that it sees begins behind it, and where the agent starts. Elsewhere it may be anything.
    """
    if not len(driven_since_start_m(path_m)):
        return True

    beyond_m = ahead_m(agent, config.blind_m, config.blind_m + ROAD_BEYOND_M)
    return bool(here.at(beyond_m, is_road).any())


def way_back(
    path: Floats, agent: Self, is_ground: Booleans, is_obstacle: Booleans, here: Here
) -> Booleans:
    """(w, h): where the agent drove since it left the largest connected part of the ground, and the
    places beside; none while it is there.

    It drove there, so that it can drive back, over a kerb too. It does not drive through what has
    come to stand there; where it was a moment ago nothing stands, whatever it saw.
    """
    labels, number = ndimage.label(is_ground, SQUARE)
    here_m = np.array([[agent.x_m, agent.y_m]])
    sizes = np.bincount(labels.ravel(), minlength=2)
    largest = 1 + int(sizes[1:].argmax())
    is_largest = labels == largest
    if not number or here.at(here_m, is_largest).any():
        return np.zeros_like(is_ground)

    was_there = np.flatnonzero(here.at(path[:, POSITION], is_largest))
    left = int(was_there.max(initial=-1)) + 1
    way = path[left:]
    is_late = way[:, PathColumn.STAMP_S] >= agent.stamp_ns * 1e-9 - CAME_S

    whole = here.has(np.vstack([way[:, POSITION], here_m]))
    late = here.has(np.vstack([way[is_late, POSITION], here_m]))
    is_way = ndimage.binary_dilation(whole, SQUARE) & ~is_obstacle
    return np.asarray(is_way | late)
