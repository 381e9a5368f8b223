"""A route as a line in the plane: legs and turns, corners rounded."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.action.config import Leg

STEP_M = 0.25
SEARCH_M = 6.0
ARC = 12


class Route:
    """Points every STEP_M along the legs, from the agent's origin, heading along x."""

    def __init__(self, legs: list[Leg], corner_radius_m: float, overrun_m: float) -> None:
        corners = [np.zeros(2)]
        heading = 0.0
        for length_m, turn_rad in legs:
            corners.append(corners[-1] + length_m * np.array([np.cos(heading), np.sin(heading)]))
            heading += turn_rad
        self.length_m = sum(length_m for length_m, _ in legs)
        corners.append(
            corners[-1] + max(overrun_m, STEP_M) * np.array([np.cos(heading), np.sin(heading)])
        )
        line = _rounded(corners, corner_radius_m)
        along_m = _along(line)
        self.leg_ends_m = along_m[ARC // 2 + 1 : -1 : ARC]
        self.points_m = _resampled(line, along_m)
        ahead = np.gradient(self.points_m, axis=0)
        turning = np.abs(np.diff(np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])), append=0.0))
        turning[-1] = 0.0
        self.curvature_per_m = turning / STEP_M
        self._at = 0

    @property
    def travelled_m(self) -> float:
        """How far along the line the agent has come."""
        return self._at * STEP_M

    @property
    def left_m(self) -> float:
        """What is left of the line, overrun included."""
        return (len(self.points_m) - 1 - self._at) * STEP_M

    @property
    def leg(self) -> int:
        """The leg that the agent is on."""
        return min(
            int(np.searchsorted(self.leg_ends_m, self.travelled_m, "right")),
            len(self.leg_ends_m) - 1,
        )

    def advance(self, x_m: float, y_m: float) -> None:
        """Find the point nearest to the agent, never going back."""
        window = self.points_m[self._at : self._at + int(SEARCH_M / STEP_M) + 1]
        self._at += int(np.argmin(np.hypot(*(window - (x_m, y_m)).T)))

    def resume(self, travelled_m: float) -> None:
        """Go on from so far along the line."""
        self._at = max(0, min(round(travelled_m / STEP_M), len(self.points_m) - 1))

    def ahead(self, distance_m: float) -> npt.NDArray[np.float64]:
        """The point so far ahead on the line."""
        point: npt.NDArray[np.float64] = self.points_m[
            min(self._at + round(distance_m / STEP_M), len(self.points_m) - 1)
        ]
        return point

    def sharpest(self, distance_m: float) -> float:
        """The sharpest curvature within so far ahead."""
        return float(
            self.curvature_per_m[self._at : self._at + round(distance_m / STEP_M) + 1].max()
        )


def _rounded(corners: list[npt.NDArray[np.float64]], radius_m: float) -> npt.NDArray[np.float64]:
    """The polyline with an arc of ARC points in place of each corner, as wide as its legs allow."""
    points = [corners[0]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        into = corner - before
        out = after - corner
        turn = np.arctan2(into[0] * out[1] - into[1] * out[0], into @ out)
        reach = min(
            radius_m * abs(np.tan(turn / 2)), np.linalg.norm(into) / 2, np.linalg.norm(out) / 2
        )
        start = corner - into / np.linalg.norm(into) * reach
        end = corner + out / np.linalg.norm(out) * reach
        share = np.linspace(0, 1, ARC)[:, None]
        points.extend((1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end)
    return np.vstack([*points, corners[-1]])


def _along(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """How far along the line each of its points is."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def _resampled(
    points: npt.NDArray[np.float64], along_m: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """The same line with a point every STEP_M."""
    at = np.arange(0.0, along_m[-1], STEP_M)
    return np.column_stack(
        [np.interp(at, along_m, points[:, 0]), np.interp(at, along_m, points[:, 1])]
    )
