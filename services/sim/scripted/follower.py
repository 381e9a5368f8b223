"""A robot that follows a line, whatever it is commanded. Pure."""

from __future__ import annotations

import numpy as np

from cogmap.schemas.process import Clock
from cogmap.schemas.sensing import MotorCommand, Pose, TruePose
from cogmap.services.sim.scripted.trajectory import Leg, Line, Trajectory

# A turn by a radian on the spot takes as long as this distance.
TURN_AS_M = 1.0


class LineFollower:
    """Simulated time advances by `tick_ns` with every step, the robot by as much of its line."""

    def __init__(self, trajectory: Trajectory, tick_ns: int, ticks_per_frame: int) -> None:
        self.tick_ns = tick_ns
        self.ticks_per_frame = ticks_per_frame
        self.now_ns = 0
        self.progress = 0.0
        self.line = Line(np.array(trajectory.line_m, float))
        self._trajectory = trajectory
        self._travelled_m = 0.0
        self._frames = 0

    def drive(self, command: MotorCommand) -> None:
        """Ignore the command: the robot follows its line."""

    def clock(self, rate: float) -> Clock:
        """The simulated time, which passes at `rate` times the wall's."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def changed_town(self) -> None:
        """None: the place does not change."""

    def truth(self) -> TruePose:
        """The robot's true pose."""
        self.progress = self._travelled_m / self.line.length_m
        return TruePose(
            stamp_ns=self.now_ns,
            pose=self._pose(),
            travelled_m=self._travelled_m,
            progress=self.progress,
        )

    def _advance(self, speed_m_s: float) -> list[Leg]:
        """Advance by one tick: the legs that the robot travels, none at rest and at the end."""
        from_m = self._travelled_m
        step_m = speed_m_s * self.tick_ns / 1e9
        to_m = min(from_m + step_m, self.line.length_m)

        self._travelled_m = to_m
        self.now_ns += self.tick_ns

        return self.line.legs(from_m, to_m) if to_m > from_m else []

    def _pace_s(self, legs: list[Leg]) -> float:
        """The time that a metre takes, where the legs together take a tick."""
        lengths_m = [length_m + TURN_AS_M * abs(turn_rad) for length_m, turn_rad in legs]
        tick_s = self.tick_ns / 1e9
        return tick_s / sum(lengths_m)

    def _pose(self) -> Pose:
        return self.line.at(self._travelled_m)

    def _next_frame(self) -> int:
        """The number of the next frame."""
        self._frames += 1
        return self._frames - 1
