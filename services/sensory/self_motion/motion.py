"""The robot's motion between two views, and what is expected of it before they are compared."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

# How fast doubt about a constant velocity grows, as random walks: over a second the speed changes
# by 2 m/s, as a car that brakes firmly, and the turn rate by 1 rad/s, as a robot that turns.
SPEED_WALK_M_S = 2.0
TURN_RATE_WALK_RAD_S = 1.0
# Before anything was measured: as fast as a car out of town, and as robots turn.
FIRST_SPEED_SD_M_S = 15.0
FIRST_TURN_RATE_SD_RAD_S = 1.0


@dataclass(frozen=True)
class Motion:
    """Distance ahead and turn between two views, with their standard deviations.

    The motion leads from its start in the direction of half the turn, plus `drift_rad`: the camera
    does not look quite where the robot goes, or it slips.
    """

    distance_m: float
    turn_rad: float
    distance_sd_m: float
    turn_sd_rad: float
    drift_rad: float = 0.0

    def combined(self, other: Motion) -> Motion:
        """Return the mean of two independent measurements of one motion, by their precision."""
        distance_m, distance_sd_m = _combined(
            (self.distance_m, self.distance_sd_m), (other.distance_m, other.distance_sd_m)
        )
        turn_rad, turn_sd_rad = _combined(
            (self.turn_rad, self.turn_sd_rad), (other.turn_rad, other.turn_sd_rad)
        )
        return Motion(distance_m, turn_rad, distance_sd_m, turn_sd_rad, self.drift_rad)


def _combined(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """Combine two values with their standard deviations; one without deviation is exact."""
    (first, first_sd), (second, second_sd) = one, other
    if min(first_sd, second_sd) <= 0.0:
        return one if first_sd <= second_sd else other

    share = second_sd**2 / (first_sd**2 + second_sd**2)
    sd = first_sd * second_sd / math.hypot(first_sd, second_sd)
    return share * first + (1 - share) * second, sd


@dataclass(frozen=True)
class Velocity:
    """Speed and turn rate as last measured, with their standard deviations."""

    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0
    speed_sd_m_s: float = FIRST_SPEED_SD_M_S
    turn_rate_sd_rad_s: float = FIRST_TURN_RATE_SD_RAD_S

    def after(self, dt_s: float) -> Velocity:
        """Return the same with the doubt that grows in `dt_s`, whatever the rate of views, up to
        what is known of any robot.
        """
        walk = math.sqrt(dt_s)
        speed_sd_m_s = math.hypot(self.speed_sd_m_s, SPEED_WALK_M_S * walk)
        turn_rate_sd_rad_s = math.hypot(self.turn_rate_sd_rad_s, TURN_RATE_WALK_RAD_S * walk)
        return replace(
            self,
            speed_sd_m_s=min(speed_sd_m_s, FIRST_SPEED_SD_M_S),
            turn_rate_sd_rad_s=min(turn_rate_sd_rad_s, FIRST_TURN_RATE_SD_RAD_S),
        )

    def over(self, dt_s: float) -> Motion:
        """Return the motion at this velocity in `dt_s`."""
        return Motion(
            distance_m=self.speed_m_s * dt_s,
            turn_rad=self.turn_rate_rad_s * dt_s,
            distance_sd_m=self.speed_sd_m_s * dt_s,
            turn_sd_rad=self.turn_rate_sd_rad_s * dt_s,
        )

    @staticmethod
    def of(motion: Motion, dt_s: float) -> Velocity:
        """Return the mean velocity of a motion that took `dt_s`."""
        return Velocity(
            speed_m_s=motion.distance_m / dt_s,
            turn_rate_rad_s=motion.turn_rad / dt_s,
            speed_sd_m_s=motion.distance_sd_m / dt_s,
            turn_rate_sd_rad_s=motion.turn_sd_rad / dt_s,
        )
