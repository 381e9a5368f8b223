"""A robot with two driven wheels, as it moves without physics: what its motors can do, and where
something is in its way. Pure.
"""

from __future__ import annotations

import math

from cogmap.robot import BODY_RADIUS_M, MAX_WHEEL_RAD_S, TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.sensing import MotorCommand, Pose, TruePose
from cogmap.services.sim.driven.surroundings import Surroundings
from cogmap.services.sim.layout.boundaries import clearance_m

# What the motors of the robot with physics give its mass: 20 Nm a wheel, 35.5 kg.
MAX_WHEEL_RAD_S2 = 28.0
# A collision is over where what was touched is so far from the middle of the body.
RELEASED_M = BODY_RADIUS_M + 0.3


class KinematicRobot:
    """A disc of BODY_RADIUS_M. `collisions` counts how often it ran into something; there it can
    only turn and move away.
    """

    def __init__(self, start: Pose, surroundings: Surroundings) -> None:
        self.collisions = 0
        self.travelled_m = 0.0
        self._surroundings = surroundings
        self._pose = (start.x_m, start.y_m, start.heading_rad)
        self._wheels_rad_s = (0.0, 0.0)
        self._wanted_rad_s = (0.0, 0.0)
        self._is_touching = False

    @property
    def pose(self) -> Pose:
        """The middle of the axle, and the heading."""
        x_m, y_m, heading_rad = self._pose
        return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

    def resume(self, last: TruePose) -> None:
        """Continue at the last true pose, at rest."""
        pose = last.pose
        self._pose = (pose.x_m, pose.y_m, pose.heading_rad)
        self.collisions = last.collisions
        self.travelled_m = last.travelled_m

    def drive(self, command: MotorCommand) -> None:
        """Obey a command from now on."""
        left = _within(command.left_wheel_rad_s, MAX_WHEEL_RAD_S)
        right = _within(command.right_wheel_rad_s, MAX_WHEEL_RAD_S)
        self._wanted_rad_s = (left, right)

    def brake(self) -> None:
        """Stop the wheels."""
        self._wanted_rad_s = (0.0, 0.0)

    def advance(self, dt_s: float) -> None:
        """Move for `dt_s`, as far as nothing is in the way."""
        distance_m, turn_rad = self._step(dt_s)

        x_m, y_m, heading_rad = self._pose
        middle_rad = heading_rad + turn_rad / 2
        to_rad = math.remainder(heading_rad + turn_rad, math.tau)
        to_x_m = x_m + distance_m * math.cos(middle_rad)
        to_y_m = y_m + distance_m * math.sin(middle_rad)

        if distance_m and self._is_in_the_way(to_x_m, to_y_m):
            self._stop()
            self._pose = (x_m, y_m, to_rad)
            return

        self._pose = (to_x_m, to_y_m, to_rad)
        self.travelled_m += abs(distance_m)
        if self._is_touching and self._clearance_m() >= RELEASED_M:
            self._is_touching = False

    def _step(self, dt_s: float) -> tuple[float, float]:
        """How far the wheels roll in `dt_s`, and by how much they turn the body."""
        left_before, right_before = self._wheels_rad_s
        self._wheels_rad_s = self._accelerated(dt_s)
        left_after, right_after = self._wheels_rad_s

        left_m = dt_s * WHEEL_RADIUS_M * (left_before + left_after) / 2
        right_m = dt_s * WHEEL_RADIUS_M * (right_before + right_after) / 2

        distance_m = (left_m + right_m) / 2
        turn_rad = (right_m - left_m) / TRACK_M
        return distance_m, turn_rad

    def _accelerated(self, dt_s: float) -> tuple[float, float]:
        """The wheels' speeds after `dt_s`."""
        most_rad_s = MAX_WHEEL_RAD_S2 * dt_s
        left, right = self._wheels_rad_s
        wanted_left, wanted_right = self._wanted_rad_s

        new_left = left + _within(wanted_left - left, most_rad_s)
        new_right = right + _within(wanted_right - right, most_rad_s)
        return new_left, new_right

    def _is_in_the_way(self, x_m: float, y_m: float) -> bool:
        """Whether something would be within the body there, and the more so than now."""
        solid_m = self._surroundings.near(x_m, y_m).solid_m
        there_m = clearance_m(solid_m, x_m, y_m)
        if there_m >= BODY_RADIUS_M:
            return False

        return there_m < self._clearance_m()

    def _clearance_m(self) -> float:
        """How far the middle of the body is from what is nearest."""
        x_m, y_m, _ = self._pose
        solid_m = self._surroundings.near(x_m, y_m).solid_m
        return clearance_m(solid_m, x_m, y_m)

    def _stop(self) -> None:
        self._wheels_rad_s = (0.0, 0.0)
        if not self._is_touching:
            self.collisions += 1
        self._is_touching = True


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
