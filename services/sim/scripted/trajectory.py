"""The way that a robot is led along, as the paper's agent is given its turns (§6). Pure."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal

import msgspec
import numpy as np
import numpy.typing as npt

from schemas.sensing import Pose
from services.sim.scripted.percepts import Landmark, Metres

Points = npt.NDArray[np.float64]
Leg = tuple[float, float]


class Way(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Where the robot is led: a line, the landmarks along it, and how far it comes in a second.

    `sensing` is how: the simulation says percepts with the errors that perception was measured to
    make, or it draws what the cameras see and says how the wheels turn. For cameras the landmarks
    are buildings of the catalogue, each by its name, as wide and high as it is there.
    """

    line_m: list[tuple[Metres, Metres]]
    landmarks: list[Landmark]
    speed_m_s: Annotated[float, msgspec.Meta(gt=0, le=100)] = 5.0
    sensing: Literal["percepts", "cameras"] = "percepts"


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
        piece = min(
            int(np.searchsorted(self.along_m, along_m, "right")) - 1, len(self.heading_rad) - 1
        )
        x, y = (float(np.interp(along_m, self.along_m, self.points[:, axis])) for axis in (0, 1))
        return Pose(x_m=x, y_m=y, heading_rad=float(self.heading_rad[piece]))

    def legs(self, from_m: float, to_m: float) -> list[Leg]:
        """The way between two places as (length_m, turn_rad): go straight, then turn on the spot."""
        corners = self.along_m[(self.along_m > from_m) & (self.along_m <= to_m)].tolist()
        stops = [from_m, *corners] if corners and corners[-1] == to_m else [from_m, *corners, to_m]
        headings = [self.at(stop).heading_rad for stop in stops]
        return [
            (b - a, math.remainder(after - before, math.tau))
            for (a, b), (before, after) in zip(
                itertools.pairwise(stops), itertools.pairwise(headings), strict=True
            )
        ]

    def nearest(self, points: Points) -> Points:
        """The points (n, 2) of the line nearest to each of (n, 2) points."""
        start = self.points[:-1]
        piece = np.diff(self.points, axis=0)
        share = ((points[:, None] - start) * piece).sum(2) / (piece**2).sum(1)
        feet = start + share.clip(0, 1)[..., None] * piece
        best = ((points[:, None] - feet) ** 2).sum(2).argmin(1)
        return np.asarray(feet[np.arange(len(points)), best])
