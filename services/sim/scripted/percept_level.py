"""A robot that follows a line and publishes percepts instead of images.

Neither physics nor images are simulated, so kilometres take seconds. The line is given; the noise
of self-motion and percepts is simulated.
"""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import (
    Building,
    Percepts,
    Pose,
    RangeScan,
    SelfMotion,
    Street,
    TrueTown,
)
from cogmap.services.sim.odometry import Noise
from cogmap.services.sim.scripted.follower import TURN_AS_M, LineFollower
from cogmap.services.sim.scripted.percepts import Landmark, PerceptErrors, PerceptSim
from cogmap.services.sim.scripted.places import PlaceSim
from cogmap.services.sim.scripted.trajectory import Leg, Trajectory

ROAD_AHEAD_M = (0.0, 3.0, 6.0, 9.0)
STREET_HALF_WIDTH_M = 12.0
SIGHT_STEP_M = 4.0

Row = tuple[float, float, float, float, float]


class PerceptLevelSim(LineFollower):
    """Publishes what sensory memory and EPAM would publish."""

    def __init__(
        self,
        trajectory: Trajectory,
        noise: Noise,
        errors: PerceptErrors,
        frame_hz: int,
        seed: int,
    ) -> None:
        tick_ns = 1_000_000_000 // frame_hz
        super().__init__(trajectory, tick_ns, ticks_per_frame=1)

        self._noise = noise
        self._seed = seed
        self._percepts = PerceptSim(errors, trajectory.landmarks, seed)
        self._places = PlaceSim(errors, seed)
        self._rng = np.random.default_rng([seed, 0x1ED])
        self._motions = np.zeros((0, 5))

    def step(self) -> list[Message]:
        """Advance by one tick; the self-motion of it is published with the view."""
        legs = self._advance(self._trajectory.speed_m_s)
        self._motions = self._self_motion(legs) if legs else self._at_rest()
        return []

    def view(self) -> list[Message]:
        """Self-motion, an empty scan, and percepts."""
        frame = self._next_frame()
        pose = self._pose()
        empty = Array.of(np.zeros(0, np.float32))

        return [
            SelfMotion(
                stamp_ns=self.now_ns,
                frame=frame,
                since_ns=self.now_ns - self.tick_ns,
                motions=Array.of(self._motions, "<f8"),
            ),
            RangeScan(stamp_ns=self.now_ns, frame=frame, bearing_rad=empty, range_m=empty),
            Percepts(
                stamp_ns=self.now_ns,
                frame=frame,
                objects=self._percepts.perceive(pose, self._visible(pose)),
                road_m=Array.of(self._road(pose), "<f4"),
                matches=self._places.recognize(frame, self.now_ns, pose),
            ),
        ]

    def town(self) -> TrueTown:
        """The line and its landmarks."""
        street = Street(name="way", line_m=self._trajectory.line_m, width_m=2 * STREET_HALF_WIDTH_M)
        return TrueTown(
            stamp_ns=self.now_ns,
            seed=self._seed,
            streets=[street],
            buildings=[_building(landmark) for landmark in self._trajectory.landmarks],
        )

    def _self_motion(self, legs: list[Leg]) -> Floats:
        """(n, 5) rows of self-motion: true speeds times noise of mean one, and drift with the root
        of the distance.

        Their standard deviations follow from the noisy speeds.
        """
        noise = self._noise
        deviations = (noise.speed, noise.turn, noise.drift_rad_per_sqrt_m)
        pace_s = self._pace_s(legs)

        rows = []
        for length_m, turn_rad in legs:
            speed, turn, drift = self._rng.normal((1.0, 1.0, 0.0), deviations).tolist()
            if length_m:
                duration_s = pace_s * length_m
                rows.append(self._straight(length_m, duration_s, speed, drift))

            if turn_rad:
                duration_s = pace_s * TURN_AS_M * abs(turn_rad)
                rows.append(self._turn(turn_rad * turn, duration_s))

        return np.array(rows).reshape(-1, 5)

    def _straight(self, length_m: float, duration_s: float, speed: float, drift: float) -> Row:
        noise = self._noise
        felt_m = length_m * speed
        drift_rad = drift * math.sqrt(length_m)
        drift_sd_rad = noise.drift_rad_per_sqrt_m * math.sqrt(length_m)

        return (
            felt_m / duration_s,
            drift_rad / duration_s,
            duration_s,
            noise.speed * abs(felt_m) / duration_s,
            drift_sd_rad / duration_s,
        )

    def _turn(self, felt_rad: float, duration_s: float) -> Row:
        turn_rate = felt_rad / duration_s
        turn_rate_sd = self._noise.turn * abs(felt_rad) / duration_s
        return 0.0, turn_rate, duration_s, 0.0, turn_rate_sd

    def _at_rest(self) -> Floats:
        duration_s = self.tick_ns / 1e9
        return np.array([[0.0, 0.0, duration_s, 0.0, 0.0]])

    def _road(self, pose: Pose) -> Floats:
        """(4, 2): points of the street ahead, in the robot's frame."""
        points_m = []

        for ahead_m in ROAD_AHEAD_M:
            along_m = min(self._travelled_m + ahead_m, self.line.length_m)
            there = self.line.at(along_m)

            points_m.append((there.x_m, there.y_m))

        return transform_to(_array(pose), np.array(points_m))

    def _visible(self, pose: Pose) -> list[int]:
        """The landmarks in the field of view that no house hides."""
        in_view = self._percepts.in_view(pose)
        return [number for number in in_view if not self._is_hidden(pose, number)]

    def _is_hidden(self, pose: Pose, number: int) -> bool:
        """Whether the line of sight to the landmark leaves the street: houses hide what stands
        behind them.
        """
        landmark = self._trajectory.landmarks[number]
        centre_m = np.array([[landmark.x_m, landmark.y_m]])
        front_m = self.line.nearest(centre_m)[0]

        eye_m = np.array([pose.x_m, pose.y_m])
        sight_m = _line_of_sight(eye_m, front_m)
        off_m = sight_m - self.line.nearest(sight_m)
        distance_m = np.hypot(off_m[:, 0], off_m[:, 1])
        return bool((distance_m > STREET_HALF_WIDTH_M).any())


def _line_of_sight(eye_m: Floats, front_m: Floats) -> Floats:
    """(n, 2): points from (2,) to (2,), SIGHT_STEP_M from one another at most."""
    distance_m = math.dist(eye_m, front_m)
    steps = max(2, math.ceil(distance_m / SIGHT_STEP_M))

    share = np.linspace(0, 1, steps)[:, None]
    sight_m: Floats = eye_m + share * (front_m - eye_m)
    return sight_m


def _array(pose: Pose) -> Floats:
    return np.array([pose.x_m, pose.y_m, pose.heading_rad])


def _building(landmark: Landmark) -> Building:
    return Building(
        name=landmark.name,
        pose=Pose(x_m=landmark.x_m, y_m=landmark.y_m, heading_rad=0.0),
        width_m=landmark.width_m,
        depth_m=landmark.width_m,
        height_m=landmark.height_m,
    )
