"""What is near the robot: walls, obstacles, barriers, kerbs and the surface of streets. Pure."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Booleans, Floats, Indices
from cogmap.robot import CAMERA_RANGE_M
from cogmap.services.sim.layout.barriers import barriers
from cogmap.services.sim.layout.boundaries import Surfaces, outlines, points_along, surfaces
from cogmap.services.sim.layout.place import Place

# For the ground a metre beyond MAX_RANGE_M (ground.py); for bodies well beyond the robot's radius.
GROUND_REACH_M = 16.0
BODY_REACH_M = 2.0
# How far the robot moves before what is near it is chosen again.
MOVED_M = 8.0
# Between points along a kerb: five in a cell of the ground.
KERB_STEP_M = 0.1


class Near(NamedTuple):
    """What is within reach of the robot.

    `walls_m` (n, 4) with `plot` (n,), the building of each; `obstacles_m` (m, 4), as they are seen;
    `solid_m` (k, 4), what it may run into; `kerbs_m`, points along the kerbs, (k, 2); the streets.
    """

    walls_m: Floats
    plot: Indices
    obstacles_m: Floats
    solid_m: Floats
    kerbs_m: Floats
    streets: Surfaces


class Surroundings:
    """A place, searched by where the robot is."""

    def __init__(self, place: Place) -> None:
        self._walls_m = place.walls_m
        walls = [len(plot.corners) for plot in place.plots]
        numbers = np.arange(len(walls))
        self._plots = np.repeat(numbers, walls)
        self._is_standing = np.ones(len(self._plots), bool)

        seen = [prop.seen for prop in place.props]
        solid = [prop.solid for prop in place.props]
        self._seen_props_m = outlines(seen)
        self._solid_props_m = outlines(solid)

        self._kerbs_m = points_along(place.kerbs_m, KERB_STEP_M)
        self._streets = surfaces(place.roads)
        self._barriers = barriers(place.roads)
        self._closing_m = outlines([])

        self._middle_m: tuple[float, float] | None = None
        self._near = self._search(place.start.x_m, place.start.y_m)

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Let barriers close these streets, and these buildings be gone, and no others."""
        closing = [self._barriers[name].solid for name in sorted(closed)]
        self._closing_m = outlines(closing)
        self._is_standing = ~np.isin(self._plots, sorted(gone))
        self._middle_m = None

    def near(self, x_m: float, y_m: float) -> Near:
        """Return what is within the camera's range of a place, and of the ground within
        GROUND_REACH_M.
        """
        middle_m = self._middle_m
        if middle_m is None or np.hypot(middle_m[0] - x_m, middle_m[1] - y_m) > MOVED_M:
            self._middle_m = (x_m, y_m)
            self._near = self._search(x_m, y_m)

        return self._near

    def _search(self, x_m: float, y_m: float) -> Near:
        reach_m = CAMERA_RANGE_M + MOVED_M
        seen_m = np.vstack([self._seen_props_m, self._closing_m])
        walls_m = self._walls_m[self._is_standing]
        is_wall = _within(walls_m, x_m, y_m, reach_m)
        is_seen = _within(seen_m, x_m, y_m, reach_m)

        solid_m = np.vstack([walls_m, self._solid_props_m, self._closing_m])
        is_solid = _within(solid_m, x_m, y_m, BODY_REACH_M + MOVED_M)

        kerb_m = np.hypot(*(self._kerbs_m - (x_m, y_m)).T)
        streets = self._streets
        street_m = np.hypot(*(streets.middle_m - (x_m, y_m)).T)
        street_m -= streets.half_length_m + streets.half_width_m

        return Near(
            walls_m=walls_m[is_wall],
            plot=self._plots[self._is_standing][is_wall],
            obstacles_m=seen_m[is_seen],
            solid_m=solid_m[is_solid],
            kerbs_m=self._kerbs_m[kerb_m <= GROUND_REACH_M + MOVED_M],
            streets=streets.chosen(street_m <= GROUND_REACH_M + MOVED_M),
        )


def _within(segments_m: Floats, x_m: float, y_m: float, reach_m: float) -> Booleans:
    """Mark, (n,), those of (n, 4) segments whose bounding box is within reach along both axes."""
    at_m = np.array([x_m, y_m])
    one_end_m = segments_m[:, :2]
    other_end_m = segments_m[:, 2:]

    low_m = np.minimum(one_end_m, other_end_m)
    high_m = np.maximum(one_end_m, other_end_m)

    begins_before = low_m <= at_m + reach_m
    ends_behind = high_m >= at_m - reach_m
    is_near = begins_before & ends_behind
    return np.asarray(is_near.all(axis=1))
