"""A robot that is led along a line, and says what it perceives instead of what its cameras see.

No engine turns its wheels and nothing is drawn, so kilometres take seconds. The way is given; the
noise of its self-motion and of its percepts is not.
"""

from __future__ import annotations

import math

import numpy as np

from schemas.array import Array
from schemas.base import Message
from schemas.process import Clock
from schemas.sensing import (
    Building,
    MotorCommand,
    Percepts,
    Pose,
    RangeScan,
    SelfMotion,
    Street,
    TruePose,
    TrueTown,
)
from services.sim.odometry import Noise
from services.sim.scripted.percepts import PerceptErrors, PerceptSense, PlaceSense
from services.sim.scripted.trajectory import Leg, Line, Points, Way

TURN_AS_M = 1.0
ROAD_AHEAD_M = (0.0, 3.0, 6.0, 9.0)
STREET_HALF_WIDTH_M = 12.0
SIGHT_STEP_M = 4.0


class Led:
    """Simulated time goes on by `tick_ns` with every step, the robot by as much of its way."""

    def __init__(self, way: Way, tick_ns: int, ticks_per_frame: int) -> None:
        self.tick_ns = tick_ns
        self.ticks_per_frame = ticks_per_frame
        self.now_ns = 0
        self.progress = 0.0
        self.line = Line(np.array(way.line_m, float))
        self._way = way
        self._at_m = 0.0
        self._frames = 0

    def drive(self, command: MotorCommand) -> None:
        """The robot goes where it is led, whatever it would."""

    def clock(self, rate: float) -> Clock:
        """Now, and how fast it goes by."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def truth(self) -> TruePose:
        """Where the robot is now."""
        self.progress = self._at_m / self.line.length_m
        return TruePose(
            stamp_ns=self.now_ns, pose=self._pose(), travelled_m=self._at_m, progress=self.progress
        )

    def _go(self, speed_m_s: float) -> list[Leg]:
        """Let one tick pass; the legs that it leads over, none at rest and at the end."""
        from_m = self._at_m
        self._at_m = min(from_m + speed_m_s * self.tick_ns / 1e9, self.line.length_m)
        self.now_ns += self.tick_ns
        return self.line.legs(from_m, self._at_m) if self._at_m > from_m else []

    def _pace_s(self, legs: list[Leg]) -> float:
        """How long a metre takes, where the legs take a tick: a turn by a radian takes as long as
        TURN_AS_M.
        """
        return (
            self.tick_ns
            / 1e9
            / sum(length_m + TURN_AS_M * abs(turn_rad) for length_m, turn_rad in legs)
        )

    def _pose(self) -> Pose:
        return self.line.at(self._at_m)

    def _number(self) -> int:
        """The next frame's."""
        self._frames += 1
        return self._frames - 1


class PerceptLevelSim(Led):
    """Says what sensory memory and EPAM would say."""

    def __init__(
        self, way: Way, noise: Noise, errors: PerceptErrors, frame_hz: int, seed: int
    ) -> None:
        super().__init__(way, 1_000_000_000 // frame_hz, 1)
        self._noise = noise
        self._seed = seed
        self._sense = PerceptSense(errors, way.landmarks, seed)
        self._places = PlaceSense(errors, seed)
        self._rng = np.random.default_rng([seed, 0x1ED])
        self._motions = np.zeros((0, 5))

    def step(self) -> list[Message]:
        """Let one tick pass; what the robot feels of it comes with the view."""
        legs = self._go(self._way.speed_m_s)
        self._motions = self._felt(legs) if legs else self._at_rest()
        return []

    def view(self) -> list[Message]:
        """What sensory memory and EPAM would say now."""
        pose = self._pose()
        number = self._number()
        since_ns = self.now_ns - self.tick_ns
        percepts = self._sense.see(
            pose, [each for each in self._sense.in_view(pose) if self._in_sight(pose, each)]
        )
        nothing = Array.of(np.zeros(0, np.float32))
        said = [
            SelfMotion(frame=number, since_ns=since_ns, motions=Array.of(self._motions, "<f8")),
            RangeScan(frame=number, bearing_rad=nothing, range_m=nothing),
            Percepts(
                frame=number,
                objects=percepts,
                road_m=Array.of(self._road(pose), "<f4"),
                matches=self._places.see(number, self.now_ns, pose),
            ),
        ]
        for message in said:
            message.stamp_ns = self.now_ns
        return [*said]

    def town(self) -> TrueTown:
        """The way and its landmarks, as of now."""
        street = Street(name="way", line_m=self._way.line_m, width_m=2 * STREET_HALF_WIDTH_M)
        buildings = [
            Building(
                name=each.name,
                pose=Pose(x_m=each.x_m, y_m=each.y_m, heading_rad=0.0),
                width_m=each.width_m,
                depth_m=each.width_m,
                height_m=each.height_m,
            )
            for each in self._way.landmarks
        ]
        return TrueTown(
            stamp_ns=self.now_ns, seed=self._seed, streets=[street], buildings=buildings
        )

    def _felt(self, legs: list[Leg]) -> Points:
        """Rows of self-motion: true speeds times noise of mean one, and drift with the root of the
        way.

        How unsure they are follows from what is felt.
        """
        noise = self._noise
        rows = []
        pace_s = self._pace_s(legs)
        for length_m, turn_rad in legs:
            speed, turn, drift = self._rng.normal(
                (1.0, 1.0, 0.0), (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
            ).tolist()
            drift_sd = noise.drift_rad_per_sqrt_m * math.sqrt(length_m)
            if length_m:
                dt = pace_s * length_m
                felt = length_m * speed, drift * math.sqrt(length_m)
                rows.append(
                    (felt[0] / dt, felt[1] / dt, dt, noise.speed * abs(felt[0]) / dt, drift_sd / dt)
                )
            if turn_rad:
                dt = pace_s * TURN_AS_M * abs(turn_rad)
                rows.append(
                    (0.0, turn_rad * turn / dt, dt, 0.0, noise.turn * abs(turn_rad * turn) / dt)
                )
        return np.array(rows).reshape(-1, 5)

    def _at_rest(self) -> Points:
        return np.array([[0.0, 0.0, self.tick_ns / 1e9, 0.0, 0.0]])

    def _road(self, pose: Pose) -> Points:
        """The street ahead, in the robot's frame."""
        ahead = [self.line.at(min(self._at_m + m, self.line.length_m)) for m in ROAD_AHEAD_M]
        off = np.array([(each.x_m - pose.x_m, each.y_m - pose.y_m) for each in ahead])
        cos = math.cos(pose.heading_rad)
        sin = math.sin(pose.heading_rad)
        return np.asarray(off @ np.array([[cos, -sin], [sin, cos]]))

    def _in_sight(self, pose: Pose, number: int) -> bool:
        """Whether one looks along the street to it: houses hide what stands behind them."""
        landmark = self._way.landmarks[number]
        target = np.array([landmark.x_m, landmark.y_m])
        front = self.line.nearest(target[None])[0]
        eye = np.array([pose.x_m, pose.y_m])
        steps = max(2, math.ceil(math.dist(eye, front) / SIGHT_STEP_M))
        between = eye + np.linspace(0, 1, steps)[:, None] * (front - eye)
        off = between - self.line.nearest(between)
        return bool((np.hypot(off[:, 0], off[:, 1]) <= STREET_HALF_WIDTH_M).all())
