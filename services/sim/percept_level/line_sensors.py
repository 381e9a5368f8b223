"""The surroundings of a line as percepts: landmarks along a street, and the street ahead. Pure."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.se2 import transform_to
from cogmap.schemas.sensing import Building, Pose, Street, TrueTown
from cogmap.services.sim.drivers.line_follower import LineFollower
from cogmap.services.sim.percept_level.percepts import PerceptErrors, PerceptSim
from cogmap.services.sim.percept_level.senses import View
from cogmap.services.sim.trajectory import Landmark, Trajectory

ROAD_AHEAD_M = (0.0, 3.0, 6.0, 9.0)
# From the line to the houses beside it; between the points of a line of sight that are checked.
STREET_HALF_WIDTH_M = 12.0
SIGHT_STEP_M = 4.0
NOTHING = np.zeros(0, np.float32)


class LineSensors:
    """Sees the landmarks that no house hides: houses stand along the street on both sides, so a
    line of sight that leaves the street meets one. The range scan is empty.
    """

    def __init__(
        self, trajectory: Trajectory, follower: LineFollower, errors: PerceptErrors, seed: int
    ) -> None:
        self._trajectory = trajectory
        self._follower = follower
        self._line = follower.line
        self._seed = seed
        self._percepts = PerceptSim(errors, trajectory.landmarks, seed)

    def look(self, pose: Pose) -> View:
        """Return the landmarks in view, and points of the street ahead."""
        eye_m = np.array([pose.x_m, pose.y_m])
        visible = []
        for number in self._percepts.in_view(pose):
            landmark = self._trajectory.landmarks[number]
            front_m = self._line.nearest(np.array([[landmark.x_m, landmark.y_m]]))[0]

            sight_m = line_of_sight_m(eye_m, front_m)
            aside_m = sight_m - self._line.nearest(sight_m)
            if (np.hypot(aside_m[:, 0], aside_m[:, 1]) <= STREET_HALF_WIDTH_M).all():
                visible.append(number)

        # A line may cross itself: the pose alone does not tell where on it the robot is.
        ahead = []
        for ahead_m in ROAD_AHEAD_M:
            there = self._line.at(min(self._follower.travelled_m + ahead_m, self._line.length_m))
            ahead.append((there.x_m, there.y_m))

        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        return View(
            bearing_rad=NOTHING,
            range_m=NOTHING,
            road_m=transform_to(at, np.array(ahead)),
            boundary_m=np.zeros((0, 2), np.float32),
            objects=self._percepts.perceive(pose, visible),
        )

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Do nothing: a line has nothing that changes."""

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the line as a street, and its landmarks as buildings."""
        line_m = self._trajectory.line_m
        street = Street(name="way", line_m=line_m, width_m=2 * STREET_HALF_WIDTH_M)
        buildings = buildings_of(self._trajectory.landmarks)
        return TrueTown(seed=self._seed, streets=[street], buildings=buildings)


def line_of_sight_m(eye_m: Floats, front_m: Floats) -> Floats:
    """Return (n, 2) points from the eye to a landmark's front, SIGHT_STEP_M apart at most."""
    steps = max(2, math.ceil(math.dist(eye_m, front_m) / SIGHT_STEP_M))
    share = np.linspace(0, 1, steps)[:, None]
    sight_m: Floats = eye_m + share * (front_m - eye_m)
    return sight_m


def buildings_of(landmarks: Iterable[Landmark]) -> list[Building]:
    """Return landmarks as buildings, as deep as they are wide."""
    buildings = []
    for landmark in landmarks:
        buildings.append(
            Building(
                name=landmark.name,
                pose=Pose(x_m=landmark.x_m, y_m=landmark.y_m, heading_rad=0.0),
                width_m=landmark.width_m,
                depth_m=landmark.width_m,
                height_m=landmark.height_m,
            )
        )

    return buildings
