"""A robot that is led along a line, and says what it perceives instead of what its cameras see.

No engine turns its wheels and nothing is drawn, so kilometres take seconds. The way is given, as the paper's agent is
given its turns (§6); the noise of its self-motion and of its percepts is not.
"""

from __future__ import annotations

import itertools
import math
from typing import Annotated

import msgspec
import numpy as np
import numpy.typing as npt

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
from services.sim.percepts import Landmark, Metres, PerceptErrors, PerceptSense, PlaceSense

Points = npt.NDArray[np.float64]
TURN_AS_M = 1.0
ROAD_AHEAD_M = (0.0, 3.0, 6.0, 9.0)
STREET_HALF_WIDTH_M = 12.0
SIGHT_STEP_M = 4.0


class Way(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Where the robot is led: a line, the landmarks along it, and how far it comes in a second."""

    line_m: list[tuple[Metres, Metres]]
    landmarks: list[Landmark]
    speed_m_s: Annotated[float, msgspec.Meta(gt=0, le=100)] = 5.0


class Line:
    """A polyline by the way along it."""

    def __init__(self, points: Points) -> None:
        apart = np.hypot(*np.diff(points, axis=0).T)
        self.points = np.vstack([points[:1], points[1:][apart > 1e-6]])
        pieces = np.diff(self.points, axis=0)
        self.along_m = np.concatenate([[0.0], np.cumsum(np.hypot(pieces[:, 0], pieces[:, 1]))])
        self.heading_rad = np.arctan2(pieces[:, 1], pieces[:, 0])

    @property
    def length_m(self) -> float:
        """From its start to its end."""
        return float(self.along_m[-1])

    def at(self, along_m: float) -> Pose:
        """The pose there, heading as the line does; at a corner as it does after it."""
        piece = min(int(np.searchsorted(self.along_m, along_m, "right")) - 1, len(self.heading_rad) - 1)
        x, y = (float(np.interp(along_m, self.along_m, self.points[:, axis])) for axis in (0, 1))
        return Pose(x_m=x, y_m=y, heading_rad=float(self.heading_rad[piece]))

    def legs(self, from_m: float, to_m: float) -> list[tuple[float, float]]:
        """The way between two places as (length_m, turn_rad): go straight, then turn on the spot."""
        corners = self.along_m[(self.along_m > from_m) & (self.along_m <= to_m)].tolist()
        stops = [from_m, *corners] if corners and corners[-1] == to_m else [from_m, *corners, to_m]
        headings = [self.at(stop).heading_rad for stop in stops]
        return [
            (b - a, math.remainder(after - before, math.tau))
            for (a, b), (before, after) in zip(itertools.pairwise(stops), itertools.pairwise(headings), strict=True)
        ]


class LedSimulation:
    """Simulated time goes on by `tick_ns` with every `tick`, the robot by as much of its way."""

    def __init__(self, way: Way, noise: Noise, errors: PerceptErrors, frame_hz: int, seed: int) -> None:
        self.tick_ns = 1_000_000_000 // frame_hz
        self.ticks_per_frame = 1
        self.now_ns = 0
        self.progress = 0.0
        self._way, self._noise, self._seed = way, noise, seed
        self._line = Line(np.array(way.line_m, float))
        self._sense = PerceptSense(errors, way.landmarks, seed)
        self._places = PlaceSense(errors, seed)
        self._rng = np.random.default_rng([seed, 0x1ED])
        self._at_m = 0.0
        self._frames = 0
        self._motions = np.zeros((0, 5))

    def drive(self, command: MotorCommand) -> None:
        """The robot goes where it is led, whatever it would."""

    def step(self) -> list[Message]:
        """Let one tick pass; what the robot feels of it comes with the view."""
        to_m = min(self._at_m + self._way.speed_m_s * self.tick_ns / 1e9, self._line.length_m)
        self._motions = self._felt(self._line.legs(self._at_m, to_m)) if to_m > self._at_m else self._at_rest()
        self._at_m = to_m
        self.now_ns += self.tick_ns
        return []

    def view(self) -> list[Message]:
        """What sensory memory and EPAM would say now."""
        pose, number = self._line.at(self._at_m), self._frames
        self._frames += 1
        since_ns = self.now_ns - self.tick_ns
        percepts = self._sense.see(pose, [each for each in self._sense.in_view(pose) if self._in_sight(pose, each)])
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

    def clock(self, rate: float) -> Clock:
        """Now, and how fast it goes by."""
        return Clock(stamp_ns=self.now_ns, rate=rate)

    def truth(self) -> TruePose:
        """Where the robot is now."""
        self.progress = self._at_m / self._line.length_m
        return TruePose(
            stamp_ns=self.now_ns, pose=self._line.at(self._at_m), travelled_m=self._at_m, progress=self.progress
        )

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
        return TrueTown(stamp_ns=self.now_ns, seed=self._seed, streets=[street], buildings=buildings)

    def _felt(self, legs: list[tuple[float, float]]) -> Points:
        """Rows of self-motion: true speeds times noise of mean one, and drift with the root of the way."""
        noise, rows = self._noise, []
        share_s = self.tick_ns / 1e9 / sum(length + TURN_AS_M * abs(turn) for length, turn in legs)
        for length_m, turn_rad in legs:
            speed, turn, drift = self._rng.normal(
                (1.0, 1.0, 0.0), (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
            ).tolist()
            drift_sd = noise.drift_rad_per_sqrt_m * math.sqrt(length_m)
            if length_m:
                dt = share_s * length_m
                felt = length_m * speed, drift * math.sqrt(length_m)
                rows.append((felt[0] / dt, felt[1] / dt, dt, noise.speed * length_m / dt, drift_sd / dt))
            if turn_rad:
                dt = share_s * TURN_AS_M * abs(turn_rad)
                rows.append((0.0, turn_rad * turn / dt, dt, 0.0, noise.turn * abs(turn_rad) / dt))
        return np.array(rows).reshape(-1, 5)

    def _at_rest(self) -> Points:
        return np.array([[0.0, 0.0, self.tick_ns / 1e9, 0.0, 0.0]])

    def _road(self, pose: Pose) -> Points:
        """The street ahead, in the robot's frame."""
        ahead = [self._line.at(min(self._at_m + m, self._line.length_m)) for m in ROAD_AHEAD_M]
        off = np.array([(each.x_m - pose.x_m, each.y_m - pose.y_m) for each in ahead])
        cos, sin = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        return np.asarray(off @ np.array([[cos, -sin], [sin, cos]]))

    def _in_sight(self, pose: Pose, number: int) -> bool:
        """Whether one looks along the street to it: houses hide what stands behind them."""
        landmark = self._way.landmarks[number]
        target = np.array([landmark.x_m, landmark.y_m])
        front = _nearest(self._line.points, target[None])[0]
        eye = np.array([pose.x_m, pose.y_m])
        steps = max(2, math.ceil(math.dist(eye, front) / SIGHT_STEP_M))
        between = eye + np.linspace(0, 1, steps)[:, None] * (front - eye)
        off = between - _nearest(self._line.points, between)
        return bool((np.hypot(off[:, 0], off[:, 1]) <= STREET_HALF_WIDTH_M).all())


def _nearest(line: Points, points: Points) -> Points:
    """The points of a polyline (k, 2) nearest to each of (n, 2) points."""
    start, piece = line[:-1], np.diff(line, axis=0)
    share = ((points[:, None] - start) * piece).sum(2) / (piece**2).sum(1)
    feet = start + share.clip(0, 1)[..., None] * piece
    best = ((points[:, None] - feet) ** 2).sum(2).argmin(1)
    return np.asarray(feet[np.arange(len(points)), best])
