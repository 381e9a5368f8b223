"""The true town in the frame of the agent's map. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.schemas.sensing import Building, Obstacle, Pose, Street, TrueTown

Transform = Callable[[Floats], Floats]
"""Transforms points (n, 2) of the world into the map."""


def town_on_map(town: TrueTown, to_map: Transform) -> TrueTown:
    """Return the streets, buildings and obstacles of a town where they are on the map."""
    return TrueTown(
        stamp_ns=town.stamp_ns,
        seed=town.seed,
        streets=[_street(street, to_map) for street in town.streets],
        buildings=[_building(building, to_map) for building in town.buildings],
        obstacles=[_obstacle(obstacle, to_map) for obstacle in town.obstacles],
    )


def pose_on_map(pose: Pose, to_map: Transform) -> Pose:
    """Return a pose where it is on the map."""
    x_m, y_m = pose.x_m, pose.y_m
    ahead_m = (x_m + math.cos(pose.heading_rad), y_m + math.sin(pose.heading_rad))
    (x_m, y_m), (ahead_x_m, ahead_y_m) = to_map(np.array([(x_m, y_m), ahead_m])).tolist()
    heading_rad = math.atan2(ahead_y_m - y_m, ahead_x_m - x_m)
    return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)


def _street(street: Street, to_map: Transform) -> Street:
    return msgspec.structs.replace(street, line_m=_points(street.line_m, to_map))


def _building(building: Building, to_map: Transform) -> Building:
    pose = pose_on_map(building.pose, to_map)
    outline_m = _points(building.outline_m, to_map)
    return msgspec.structs.replace(building, pose=pose, outline_m=outline_m)


def _obstacle(obstacle: Obstacle, to_map: Transform) -> Obstacle:
    return msgspec.structs.replace(obstacle, pose=pose_on_map(obstacle.pose, to_map))


def _points(points_m: list[tuple[float, float]], to_map: Transform) -> list[tuple[float, float]]:
    return [(x_m, y_m) for x_m, y_m in to_map(np.array(points_m).reshape(-1, 2)).tolist()]
