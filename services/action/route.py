"""A route as a line in the plane, of legs and turns or of a plan, corners rounded. Pure."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import distances_along, resample
from services.action.config import Leg

STEP_M = 0.25
SEARCH_M = 6.0
ARC_POINTS = 12
SMOOTHED_M = 3.0


class Route:
    """Points every STEP_M along `line_m`, (n, 2), that the agent is to follow."""

    def __init__(self, line_m: Floats, leg_ends_m: Floats | None = None) -> None:
        self.leg_ends_m = np.zeros(0) if leg_ends_m is None else leg_ends_m
        self.points_m = resample(line_m, STEP_M)
        self.curvature_per_m = _curvature(self.points_m)
        self._index = 0

    @classmethod
    def of_legs(cls, legs: list[Leg], corner_radius_m: float, overrun_m: float) -> Route:
        """The line along the legs, from the agent's origin, heading along x."""
        overrun_m = max(overrun_m, STEP_M)
        corners = _corners(legs, overrun_m)
        line_m = _rounded(corners, corner_radius_m)

        along_m = distances_along(line_m)
        return cls(line_m, along_m[ARC_POINTS // 2 + 1 : -1 : ARC_POINTS])

    @classmethod
    def of_plan(cls, places_m: Floats) -> Route:
        """The line past the place nodes of a plan, (n, 2), smoothed over SMOOTHED_M."""
        if len(places_m) < 2:
            a_step_m = np.array([STEP_M, 0.0])
            places_m = np.vstack([places_m, places_m[-1] + a_step_m])

        line_m = resample(places_m, STEP_M)
        return cls(_smoothed(line_m))

    @property
    def travelled_m(self) -> float:
        """Distance along the line from its start to the agent."""
        return self._index * STEP_M

    @property
    def left_m(self) -> float:
        """Distance along the line from the agent to its end, overrun included."""
        return (self._last - self._index) * STEP_M

    @property
    def leg(self) -> int:
        """The index of the leg that the agent is on."""
        passed = int(np.searchsorted(self.leg_ends_m, self.travelled_m, "right"))
        return max(0, min(passed, len(self.leg_ends_m) - 1))

    def advance(self, x_m: float, y_m: float) -> None:
        """Find the point nearest to the agent within SEARCH_M ahead, never backwards."""
        last = self._index + int(SEARCH_M / STEP_M)
        window_m = self.points_m[self._index : last + 1]

        away_x_m, away_y_m = (window_m - (x_m, y_m)).T
        away_m = np.hypot(away_x_m, away_y_m)
        self._index += int(np.argmin(away_m))

    def resume(self, travelled_m: float) -> None:
        """Continue from a distance along the line."""
        index = round(travelled_m / STEP_M)
        index = min(index, self._last)

        self._index = max(0, index)

    def ahead(self, distance_m: float) -> tuple[float, float]:
        """The point of the line `distance_m` ahead of the agent, at most its end."""
        steps = round(distance_m / STEP_M)
        index = min(self._index + steps, self._last)

        x_m, y_m = self.points_m[index].tolist()
        return x_m, y_m

    def sharpest(self, distance_m: float) -> float:
        """The sharpest curvature within `distance_m` ahead, per metre."""
        last = self._index + round(distance_m / STEP_M)
        window_per_m = self.curvature_per_m[self._index : last + 1]

        return float(window_per_m.max())

    @property
    def _last(self) -> int:
        return len(self.points_m) - 1


def _corners(legs: list[Leg], overrun_m: float) -> list[Floats]:
    """The ends of the legs, from the origin, and the end of the overrun."""
    corner_m = np.zeros(2)
    corners = [corner_m]
    heading_rad = 0.0
    for length_m, turn_rad in legs:
        corner_m = corner_m + length_m * _direction(heading_rad)
        corners.append(corner_m)
        heading_rad += turn_rad

    corners.append(corner_m + overrun_m * _direction(heading_rad))

    return corners


def _direction(heading_rad: float) -> Floats:
    cos = np.cos(heading_rad)
    sin = np.sin(heading_rad)
    return np.array([cos, sin])


def _rounded(corners: list[Floats], radius_m: float) -> Floats:
    """The polyline with an arc of ARC_POINTS in place of each corner, as wide as its legs allow."""
    points = [corners[0]]
    for (before, corner), (_, after) in pairwise(pairwise(corners)):
        points.extend(_arc(before, corner, after, radius_m))

    return np.vstack([*points, corners[-1]])


def _arc(before: Floats, corner: Floats, after: Floats, radius_m: float) -> Floats:
    """(ARC_POINTS, 2): a quadratic Bezier curve that cuts `corner`."""
    into_m = corner - before
    out_m = after - corner
    into_length_m = np.linalg.norm(into_m)
    out_length_m = np.linalg.norm(out_m)

    cross = into_m[0] * out_m[1] - into_m[1] * out_m[0]
    turn_rad = np.arctan2(cross, into_m @ out_m)
    cut_m = min(radius_m * abs(np.tan(turn_rad / 2)), into_length_m / 2, out_length_m / 2)
    start = corner - into_m / into_length_m * cut_m
    end = corner + out_m / out_length_m * cut_m

    share = np.linspace(0, 1, ARC_POINTS)[:, None]
    curve: Floats = (1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end

    return curve


def _curvature(points_m: Floats) -> Floats:
    """(n,): the curvature of a line of points every STEP_M, per metre, without sign."""
    ahead = np.gradient(points_m, axis=0)
    heading_rad = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))

    turn_rad = np.abs(np.diff(heading_rad, append=0.0))
    turn_rad[-1] = 0.0
    curvature_per_m: Floats = turn_rad / STEP_M

    return curvature_per_m


def _smoothed(points_m: Floats) -> Floats:
    """The line of (n, 2) points, each the mean of those within SMOOTHED_M / 2, its ends kept."""
    reach = round(SMOOTHED_M / 2 / STEP_M)
    padded = np.pad(points_m, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")

    kernel = np.full(2 * reach + 1, 1 / (2 * reach + 1))
    columns = [np.convolve(column, kernel, mode="valid") for column in padded.T]
    smoothed: Floats = np.column_stack(columns)
    return smoothed
