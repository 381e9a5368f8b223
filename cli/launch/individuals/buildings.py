"""The true buildings of a town, and which of them a place shows. Pure."""

from __future__ import annotations

import cv2
import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.polylines import nearest_on_pieces
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.sensing import Building, TrueTown

NEAR_M = 3.0
"""What is farther from every footprint shows no building: less than half of the smallest one."""

NOTHING = -1
CORNERS = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) / 2


class Buildings:
    """The buildings of a town: `names`, and the `centres_m` of their footprints, (n, 2)."""

    def __init__(self, town: TrueTown | None) -> None:
        built = town.buildings if town is not None else []
        self.names = [building.name for building in built]
        places = [(building.pose.x_m, building.pose.y_m) for building in built]
        self.centres_m = np.array(places, np.float64).reshape(-1, 2)
        self._outlines_m = [_outline_m(building) for building in built]

    def shown_at(self, points_m: Floats) -> Indices:
        """Return the number of the building whose footprint each of (k, 2) points of the world is
        in, or nearest to within NEAR_M; NOTHING where there is none.
        """
        shown = np.full(len(points_m), NOTHING)
        if not self.names or not len(points_m):
            return shown

        starts_m = np.vstack(self._outlines_m)
        ends_m = np.vstack([np.roll(outline_m, -1, axis=0) for outline_m in self._outlines_m])
        sides = [len(outline_m) for outline_m in self._outlines_m]
        owners = np.repeat(np.arange(len(sides)), sides)

        # Footprints do not overlap: the wall nearest to a point within one is its own.
        nearest = nearest_on_pieces(starts_m, ends_m, points_m)
        owner = owners[nearest.piece]
        away_m = np.hypot(*(points_m - nearest.foot_m).T)
        for number, (building, point_m) in enumerate(zip(owner.tolist(), points_m, strict=True)):
            if away_m[number] <= NEAR_M or _holds(self._outlines_m[building], point_m):
                shown[number] = building

        return shown


def _outline_m(building: Building) -> Floats:
    """Return the (n, 2) corners of a building's footprint."""
    if building.outline_m:
        return np.array(building.outline_m, np.float64)

    pose = np.array([building.pose.x_m, building.pose.y_m, building.pose.heading_rad])
    return transform_from(pose, CORNERS * (building.width_m, building.depth_m))


def _holds(outline_m: Floats, point_m: Floats) -> bool:
    """Decide whether a point (2,) is within an outline (n, 2)."""
    x_m, y_m = point_m.tolist()
    side = cv2.pointPolygonTest(outline_m.astype(np.float32), (x_m, y_m), measureDist=False)
    return side >= 0
