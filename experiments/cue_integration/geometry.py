"""Nardini's room, in metres: where the landmarks and posts are, and how a walker steps from one to
the other.

The positions are those published with Kessler et al. (2024) for the experiment of Nardini et al.
(2008).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Point = tuple[float, float]
Points = npt.NDArray[np.float64]

START: Point = (2.5, 0.0)
START_HEADING_RAD = math.pi / 2
LANDMARKS: tuple[Point, ...] = ((2.5, 7.0), (4.324, 4.824), (0.676, 4.824))
POSTS: tuple[Point, ...] = (
    (3.453, 4.468),
    (1.547, 4.468),
    (2.834, 4.718),
    (2.166, 4.718),
    (3.213, 4.099),
    (1.787, 4.099),
    (2.750, 4.286),
    (2.250, 4.286),
    (2.5, 3.0),
)
ROUTES: tuple[tuple[int, int, int], ...] = (
    (0, 5, 8),
    (0, 7, 8),
    (1, 4, 8),
    (1, 6, 8),
    (2, 5, 8),
    (2, 7, 8),
    (3, 4, 8),
    (3, 6, 8),
)
CONFLICT_RAD = math.radians(15)

STEP_M = 0.5
STEP_RAD = math.radians(60)
WHILE_TURNING_M = 0.1
REACH_M = 0.3


@dataclass(frozen=True)
class Pose:
    """Where somebody stands and faces; heading counter-clockwise from x."""

    x_m: float
    y_m: float
    heading_rad: float

    @property
    def position(self) -> Point:
        """Return the position without the heading."""
        return self.x_m, self.y_m

    def after(self, turn_rad: float, forward_m: float) -> Pose:
        """Return the pose after a turn on the spot and then a walk straight on."""
        heading_rad = self.heading_rad + turn_rad
        x_m = self.x_m + forward_m * math.cos(heading_rad)
        y_m = self.y_m + forward_m * math.sin(heading_rad)
        return Pose(x_m, y_m, heading_rad)

    def towards(self, goal: Point) -> tuple[float, float]:
        """Return the bearing, left positive, and the distance of `goal`."""
        x_m, y_m = goal
        dx_m = x_m - self.x_m
        dy_m = y_m - self.y_m
        distance_m = math.hypot(dx_m, dy_m)

        direction_rad = math.atan2(dy_m, dx_m)
        bearing_rad = math.remainder(direction_rad - self.heading_rad, math.tau)
        return bearing_rad, distance_m


def step(bearing_rad: float, distance_m: float) -> tuple[float, float]:
    """Return the next movement, until a goal is within reach: a turn, and a distance forward.

    The distance is short while the goal is not yet ahead.
    """
    turn_rad = max(-STEP_RAD, min(STEP_RAD, bearing_rad))
    is_ahead = turn_rad == bearing_rad
    max_m = STEP_M if is_ahead else WHILE_TURNING_M

    missing_m = distance_m - REACH_M
    forward_m = max(0.0, min(missing_m, max_m))
    return turn_rad, forward_m


def turned(
    points: tuple[Point, ...], angle_rad: float, about: Point = POSTS[8]
) -> tuple[Point, ...]:
    """Return `points` turned counter-clockwise about another; by 15° about post 8, the targets move
    0.457 m.
    """
    cos = math.cos(angle_rad)
    sin = math.sin(angle_rad)
    about_x_m, about_y_m = about
    found = []

    for x_m, y_m in points:
        dx_m = x_m - about_x_m
        dy_m = y_m - about_y_m
        turned_x_m = about_x_m + cos * dx_m - sin * dy_m
        turned_y_m = about_y_m + sin * dx_m + cos * dy_m
        found.append((turned_x_m, turned_y_m))

    return tuple(found)
