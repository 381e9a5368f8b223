"""The line that a robot follows, as the paper's agent is given its turns (§6). Pure."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.geometry.polylines import distances_along, nearest_on_line
from cogmap.schemas.base import Coordinate, Name, PositiveMetres, PositiveSpeed
from cogmap.schemas.sensing import Pose

Leg = tuple[float, float]
Drawn = Literal["view", "leg"]
# Nearer than this, two points are one: above the rounding of coordinates.
SAME_POINT_M = 1e-6


class Landmark(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A building that perception knows by name."""

    name: Annotated[Name, msgspec.Meta(description="Its name.")]
    x_m: Annotated[Coordinate, msgspec.Meta(description="The x of its centre, in m.")]
    y_m: Annotated[Coordinate, msgspec.Meta(description="The y of its centre, in m.")]
    width_m: Annotated[PositiveMetres, msgspec.Meta(description="Its apparent width, in m.")] = 10.0
    height_m: Annotated[PositiveMetres, msgspec.Meta(description="Its apparent height, in m.")] = (
        8.0
    )
    function: Annotated[
        str,
        msgspec.Meta(
            description="What it is used for, as perception knows of one by that name; empty "
            "where it does not.",
            max_length=200,
        ),
    ] = ""


class Trajectory(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A line, the landmarks along it, and how fast a robot follows it.

    With cameras the landmarks are buildings of the catalogue, each by its name, as wide and high as
    it is there.
    """

    line_m: Annotated[
        list[tuple[Coordinate, Coordinate]],
        msgspec.Meta(min_length=2, description="Points of the line, x and y in m."),
    ]
    landmarks: Annotated[list[Landmark], msgspec.Meta(description="Buildings along the line.")]
    speed_m_s: Annotated[PositiveSpeed, msgspec.Meta(description="Speed of the robot, in m/s.")] = (
        5.0
    )
    noise_drawn: Annotated[
        Drawn,
        msgspec.Meta(
            description="How long the factors of noise stay. view: they are drawn anew for each "
            "view. leg: they are alike until the line turns."
        ),
    ] = "view"
    sensing: Annotated[
        Literal["percepts", "cameras"],
        msgspec.Meta(
            description="percepts: published with the errors that perception was measured to "
            "make. cameras: rendered images and odometry are published, and "
            "perception runs."
        ),
    ] = "percepts"


class Line:
    """A polyline by the distance along it, without points that coincide with the one before."""

    def __init__(self, points_m: Floats) -> None:
        lengths_m = np.hypot(*np.diff(points_m, axis=0).T)
        is_new = lengths_m > SAME_POINT_M
        others_m = points_m[1:][is_new]

        self.points = np.vstack([points_m[:1], others_m])
        self.along_m = distances_along(self.points)

        pieces_m = np.diff(self.points, axis=0)
        self.heading_rad = np.arctan2(pieces_m[:, 1], pieces_m[:, 0])

    @property
    def length_m(self) -> float:
        """Return the distance from its start to its end, along it."""
        return float(self.along_m[-1])

    def at(self, along_m: float) -> Pose:
        """Return the pose there, heading as the line does; at a corner as it does after it."""
        corners_passed = int(np.searchsorted(self.along_m, along_m, "right"))
        last = len(self.heading_rad) - 1
        heading_rad = self.heading_rad[min(corners_passed - 1, last)]

        x_m = np.interp(along_m, self.along_m, self.points[:, 0])
        y_m = np.interp(along_m, self.along_m, self.points[:, 1])

        return Pose(
            x_m=float(x_m),
            y_m=float(y_m),
            heading_rad=float(heading_rad),
        )

    def legs(self, from_m: float, to_m: float) -> list[Leg]:
        """Return the line between two distances as (length_m, turn_rad): straight, then a turn on
        the spot.
        """
        legs = []
        for start_m, end_m in pairwise(self._stops_m(from_m, to_m)):
            before_rad = self.at(start_m).heading_rad
            after_rad = self.at(end_m).heading_rad

            turn_rad = math.remainder(after_rad - before_rad, math.tau)
            legs.append((end_m - start_m, turn_rad))

        return legs

    def _stops_m(self, from_m: float, to_m: float) -> list[float]:
        """Return the two distances, and those of the points between them."""
        is_between = (self.along_m > from_m) & (self.along_m <= to_m)
        stops_m = [from_m, *self.along_m[is_between].tolist()]
        if stops_m[-1] != to_m or len(stops_m) == 1:
            stops_m.append(to_m)

        return stops_m

    def nearest(self, points_m: Floats) -> Floats:
        """Return the (n, 2) points of the line nearest to each of (n, 2) points."""
        return nearest_on_line(self.points, points_m).foot_m
