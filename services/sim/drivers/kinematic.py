"""A robot with two driven wheels, as it moves without physics: what its motors can do, and where
something is in its way. Pure.
"""

from __future__ import annotations

import math

from cogmap.robot import BODY_RADIUS_M, MAX_WHEEL_RAD_S, TRACK_M, WHEEL_RADIUS_M
from cogmap.schemas.sensing import MotorCommand, Pose, TruePose
from cogmap.services.sim.layout.boundaries import clearance_m
from cogmap.services.sim.odometry import Motion, Noise, WheelOdometry
from cogmap.services.sim.percept_level.surroundings import Surroundings

MAX_WHEEL_RAD_S2 = 28.0
"""What the motors of the robot with physics give its mass: 20 Nm a wheel, 35.5 kg."""

RELEASED_M = BODY_RADIUS_M + 0.3
"""A collision is over once what was touched is so far from the middle of the body."""


class KinematicRobot:
    """A disc of BODY_RADIUS_M. `collisions` counts how often it ran into something; there it can
    only turn and move away.
    """

    course_share = None

    def __init__(
        self, start: Pose, surroundings: Surroundings, noise: Noise | None = None, seed: int = 0
    ) -> None:
        self.collisions = 0
        self.travelled_m = 0.0
        self.pose = start
        self._surroundings = surroundings
        self._odometry = WheelOdometry(noise or Noise(), seed)
        self._wheels_rad_s = (0.0, 0.0)
        self._wanted_rad_s = (0.0, 0.0)
        self._is_touching = False

    def resume(self, last: TruePose) -> None:
        """Continue at the last true pose, at rest."""
        self.pose = last.pose
        self.collisions = last.collisions
        self.travelled_m = last.travelled_m
        self._wheels_rad_s = (0.0, 0.0)
        self._wanted_rad_s = (0.0, 0.0)
        self._is_touching = False

    def drive(self, command: MotorCommand) -> None:
        """Obey a command from now on."""
        left = _within(command.left_wheel_rad_s, MAX_WHEEL_RAD_S)
        right = _within(command.right_wheel_rad_s, MAX_WHEEL_RAD_S)
        self._wanted_rad_s = (left, right)

    def brake(self) -> None:
        """Stop the wheels."""
        self._wanted_rad_s = (0.0, 0.0)

    def advance(self, dt_s: float) -> list[Motion]:
        """Move for `dt_s`, as far as nothing is in the way."""
        before = self.pose
        left_before, right_before = self._wheels_rad_s
        left_wanted, right_wanted = self._wanted_rad_s

        most_rad_s = MAX_WHEEL_RAD_S2 * dt_s
        left_after = left_before + _within(left_wanted - left_before, most_rad_s)
        right_after = right_before + _within(right_wanted - right_before, most_rad_s)
        self._wheels_rad_s = (left_after, right_after)

        left_m = dt_s * WHEEL_RADIUS_M * (left_before + left_after) / 2
        right_m = dt_s * WHEEL_RADIUS_M * (right_before + right_after) / 2
        distance_m = (left_m + right_m) / 2
        turn_rad = (right_m - left_m) / TRACK_M

        middle_rad = before.heading_rad + turn_rad / 2
        to_rad = math.remainder(before.heading_rad + turn_rad, math.tau)
        to_x_m = before.x_m + distance_m * math.cos(middle_rad)
        to_y_m = before.y_m + distance_m * math.sin(middle_rad)

        if distance_m and self._is_in_the_way(to_x_m, to_y_m):
            self._wheels_rad_s = (0.0, 0.0)
            self.collisions += not self._is_touching
            self._is_touching = True
            self.pose = Pose(x_m=before.x_m, y_m=before.y_m, heading_rad=to_rad)
        else:
            self.pose = Pose(x_m=to_x_m, y_m=to_y_m, heading_rad=to_rad)
            self.travelled_m += abs(distance_m)
            if self._is_touching and self._clearance_m(to_x_m, to_y_m) >= RELEASED_M:
                self._is_touching = False

        return [self._odometry.measure(before, self.pose, dt_s)]

    def _is_in_the_way(self, x_m: float, y_m: float) -> bool:
        """Decide whether something would be within the body there, and more so than now."""
        there_m = self._clearance_m(x_m, y_m)
        if there_m >= BODY_RADIUS_M:
            return False
        return there_m < self._clearance_m(self.pose.x_m, self.pose.y_m)

    def _clearance_m(self, x_m: float, y_m: float) -> float:
        """Return how far a place is from what is nearest to it."""
        return clearance_m(self._surroundings.near(x_m, y_m).solid_m, x_m, y_m)


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
