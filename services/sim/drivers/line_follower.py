"""A robot that follows a line, whatever it is commanded. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.schemas.sensing import MotorCommand, Pose, TruePose
from cogmap.services.sim.odometry import Motion, Noise
from cogmap.services.sim.trajectory import Line, Trajectory

TURN_AS_M = 1.0
"""A turn by a radian on the spot takes as long as this distance."""


ROUNDED_M = 1e-9
"""What is left of a tick after a corner may be as short as this by rounding, and is no motion."""


class LineFollower:
    """Travels along its line at a constant speed, after it has stood for `rest_ticks` ticks."""

    collisions = 0

    def __init__(
        self, trajectory: Trajectory, noise: Noise, seed: int, rest_ticks: int = 0
    ) -> None:
        self.travelled_m = 0.0
        self.line = Line(np.array(trajectory.line_m, float))
        self._speed_m_s = trajectory.speed_m_s
        self._rest_ticks = rest_ticks
        self._noise = noise
        self._is_drawn_by_leg = trajectory.noise_drawn == "leg"
        self._factors: tuple[float, float, float] | None = None
        self._rng = np.random.default_rng([seed, 0x1ED])

    @property
    def pose(self) -> Pose:
        """Return the pose on the line, heading as it does."""
        return self.line.at(self.travelled_m)

    @property
    def course_share(self) -> float:
        """Return the share of the line that is travelled, 0 to 1."""
        return self.travelled_m / self.line.length_m

    def drive(self, command: MotorCommand) -> None:
        """Ignore the command."""

    def brake(self) -> None:
        """Ignore the order to stop."""

    def resume(self, last: TruePose) -> None:
        """Continue where a robot was that had travelled as far."""
        self.travelled_m = last.travelled_m

    def advance(self, dt_s: float) -> list[Motion]:
        """Advance by a tick: the self-motion of each straight and of each turn on the spot.

        True speeds are multiplied by noise of mean one, and the heading drifts with the root of
        the distance.
        """
        if self._rest_ticks:
            self._rest_ticks -= 1
            return [Motion(0.0, 0.0, dt_s)]

        from_m = self.travelled_m
        self.travelled_m = min(from_m + self._speed_m_s * dt_s, self.line.length_m)
        if self.travelled_m <= from_m:
            return [Motion(0.0, 0.0, dt_s)]

        # The legs take the tick together, each its part by its length.
        legs = self.line.legs(from_m, self.travelled_m)
        pace_s = dt_s / sum(length_m + TURN_AS_M * abs(turn_rad) for length_m, turn_rad in legs)

        noise = self._noise
        motions = []
        for length_m, turn_rad in legs:
            speed, turn, drift = self._drawn()
            if length_m > ROUNDED_M:
                duration_s = pace_s * length_m
                felt_m = length_m * speed
                drift_rad = drift * math.sqrt(length_m)
                drift_sd_rad = noise.drift_rad_per_sqrt_m * math.sqrt(length_m)
                motions.append(
                    Motion(
                        felt_m / duration_s,
                        drift_rad / duration_s,
                        duration_s,
                        noise.speed * abs(felt_m) / duration_s,
                        drift_sd_rad / duration_s,
                    )
                )

            if turn_rad:
                duration_s = pace_s * TURN_AS_M * abs(turn_rad)
                felt_rad = turn_rad * turn
                sd_rad_s = noise.turn * abs(felt_rad) / duration_s
                motions.append(Motion(0.0, felt_rad / duration_s, duration_s, 0.0, sd_rad_s))
                self._factors = None

        return motions

    def _drawn(self) -> tuple[float, float, float]:
        """Return the factors of speed and turn, and the drift: drawn anew, or those of the leg."""
        if self._factors is None or not self._is_drawn_by_leg:
            noise = self._noise
            deviations = (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
            speed, turn, drift = self._rng.normal((1.0, 1.0, 0.0), deviations).tolist()
            self._factors = (speed, turn, drift)
        return self._factors
