"""A route as a line in the plane, smoothed, and how it is driven. Pure."""

from __future__ import annotations

import math

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import resample
from cogmap.schemas.sensing import Pose, SpeedLimit
from cogmap.services.motor.aim import Aim, Speed, bearing_of, in_bend, slowest
from cogmap.services.motor.config import Config

# Between the points of a line: a quarter of a place.
STEP_M = 0.25
# The agent is looked for so far ahead on the line: more than it drives from view to view (0.8 m).
SEARCH_M = 6.0
# Three places: a line over a grid goes in steps of one.
SMOOTHED_M = 3.0
LOOKAHEAD_M = 2.5
"""Distance of the point that pure pursuit steers to: 0.6 s at cruising speed."""


class Route:
    """The line past the place nodes of a plan, (n, 2) `places_m`, two of them at least, smoothed
    over SMOOTHED_M: points every STEP_M that the agent is to follow.
    """

    def __init__(self, places_m: Floats) -> None:
        line_m = resample(places_m, STEP_M)
        self.points_m = resample(_smoothed(line_m), STEP_M)
        self._last = len(self.points_m) - 1
        self._index = 0

        ahead = np.gradient(self.points_m, axis=0)
        heading_rad = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
        turn_rad = np.abs(np.diff(heading_rad, append=0.0))
        turn_rad[-1] = 0.0
        self.curvature_per_m: Floats = turn_rad / STEP_M

    @property
    def travelled_m(self) -> float:
        """Return the distance along the line from its start to the agent."""
        return self._index * STEP_M

    @property
    def left_m(self) -> float:
        """Return the distance along the line from the agent to its end."""
        return (self._last - self._index) * STEP_M

    def advance(self, x_m: float, y_m: float) -> None:
        """Find the point nearest to the agent within SEARCH_M ahead, never backwards."""
        last = self._index + int(SEARCH_M / STEP_M)
        window_m = self.points_m[self._index : last + 1]
        self._index += _nearest(window_m, x_m, y_m)

    def join(self, x_m: float, y_m: float) -> None:
        """Begin at the point of the whole line that is nearest to the agent."""
        self._index = _nearest(self.points_m, x_m, y_m)

    @property
    def pose(self) -> Floats:
        """Return the point of the line where the agent is, and the direction there, (3,)."""
        first = max(0, min(self._index, self._last - 1))
        ahead_x_m, ahead_y_m = (self.points_m[first + 1] - self.points_m[first]).tolist()
        x_m, y_m = self.points_m[self._index].tolist()
        return np.array([x_m, y_m, math.atan2(ahead_y_m, ahead_x_m)])

    def ahead(self, distance_m: float) -> tuple[float, float]:
        """Return the point of the line `distance_m` ahead of the agent, at most its end."""
        steps = round(distance_m / STEP_M)
        index = min(self._index + steps, self._last)

        x_m, y_m = self.points_m[index].tolist()
        return x_m, y_m

    def sharpest(self, distance_m: float) -> float:
        """Find the sharpest curvature within `distance_m` ahead, per metre."""
        last = self._index + round(distance_m / STEP_M)
        window_per_m = self.curvature_per_m[self._index : last + 1]

        return float(window_per_m.max())


def pursuit(route: Route, pose: Pose, config: Config) -> Aim:
    """Aim at the point of a route that pure pursuit steers to from a pose, at the highest speed
    that the bend ahead and the end of the route allow.
    """
    route.advance(pose.x_m, pose.y_m)
    x_m, y_m = route.ahead(LOOKAHEAD_M)
    away_m = math.hypot(x_m - pose.x_m, y_m - pose.y_m)
    distance_m = max(LOOKAHEAD_M / 2, away_m)

    braking_distance_m = config.cruise_m_s**2 / (2 * config.braking_m_s2)
    bend_per_m = route.sharpest(braking_distance_m)
    to_end_m_s = math.sqrt(2 * config.braking_m_s2 * route.left_m)
    speed = slowest(
        Speed(config.cruise_m_s),
        in_bend(bend_per_m, config),
        Speed(to_end_m_s, SpeedLimit.ROUTE_END),
    )
    return Aim(bearing_of(x_m, y_m, pose), distance_m, speed)


def _nearest(points_m: Floats, x_m: float, y_m: float) -> int:
    """Find the index of the one of (n, 2) points nearest to a position, the first of several."""
    away_m = np.hypot(*(points_m - (x_m, y_m)).T)
    return int(away_m.argmin())


def _smoothed(points_m: Floats) -> Floats:
    """Smooth a line of (n, 2) points: average those within SMOOTHED_M / 2, but keep its ends."""
    reach = round(SMOOTHED_M / 2 / STEP_M)
    padded = np.pad(points_m, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")

    kernel = np.full(2 * reach + 1, 1 / (2 * reach + 1))
    columns = [np.convolve(column, kernel, mode="valid") for column in padded.T]
    smoothed: Floats = np.column_stack(columns)
    return smoothed
