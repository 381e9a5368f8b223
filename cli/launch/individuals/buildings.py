"""The true buildings of a town, and which of them a place shows. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.geometry.arrays import Floats, Indices
from cogmap.geometry.polylines import crossings_of, nearest_on_pieces
from cogmap.geometry.se2 import transform_from
from cogmap.schemas.sensing import Building, Calibration, TrueTown

NEAR_M = 3.0
"""What is farther from every footprint shows no building: less than half of the smallest one."""

SAMPLES = 80
"""Pixels by which it is found out what is within an outline."""

MIN_CORNERS = 3

NOTHING = -1
CORNERS = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) / 2


class Walls(NamedTuple):
    """m upright pieces from (m, 2) `starts_m` to `ends_m`, and the number of the building that each
    is of: walls as high as the eaves, gables, higher by `gables_m` in their middle, and what is
    below a ridge. A ray from below the eaves that meets a roof meets one of them.
    """

    starts_m: Floats
    ends_m: Floats
    eaves_m: Floats
    gables_m: Floats
    owners: Indices

    def tops_m(self, share: Floats) -> Floats:
        """Return how high each is at a share (k, m) of its length."""
        tops_m: Floats = self.eaves_m + self.gables_m * (1 - np.abs(2 * share - 1))
        return tops_m


class Buildings:
    """The buildings of a town: `names`, and the `centres_m` of their footprints, (n, 2)."""

    def __init__(self, town: TrueTown | None) -> None:
        built = town.buildings if town is not None else []
        self.names = [building.name for building in built]
        places = [(building.pose.x_m, building.pose.y_m) for building in built]
        self.centres_m = np.array(places, np.float64).reshape(-1, 2)
        self._outlines_m = [_outline_m(building) for building in built]
        self._walls = _together([_walls_of(*each) for each in enumerate(built)])

    def shown_at(self, points_m: Floats) -> Indices:
        """Return the number of the building whose footprint each of (k, 2) points of the world is
        in, or nearest to within NEAR_M; NOTHING where there is none.
        """
        shown = np.full(len(points_m), NOTHING)
        if not self.names or not len(points_m):
            return shown

        # Footprints do not overlap: the wall nearest to a point within one is its own.
        nearest = nearest_on_pieces(self._walls.starts_m, self._walls.ends_m, points_m)
        owner = self._walls.owners[nearest.piece]
        away_m = np.hypot(*(points_m - nearest.foot_m).T)
        for number, (building, point_m) in enumerate(zip(owner.tolist(), points_m, strict=True)):
            if away_m[number] <= NEAR_M or _holds(self._outlines_m[building], point_m):
                shown[number] = building

        return shown

    def shown_by(
        self,
        pose: Floats,
        place: tuple[float, float],
        outline_px: Sequence[tuple[int, int]],
        camera: Calibration | None,
    ) -> int:
        """Return the number of the building that a percept shows, from a robot at `pose` (3,) in
        the world: that of most of its outline in the view, or the one at its `place`, a bearing in
        rad and a range in m, if no camera saw it. NOTHING if there is none.
        """
        if camera is not None and outline_px:
            return self.shown_in(pose, outline_px, camera)

        bearing_rad, range_m = place
        direction = np.array([np.cos(bearing_rad), np.sin(bearing_rad)])
        (building,) = self.shown_at(transform_from(pose, range_m * direction[None])).tolist()
        return int(building)

    def shown_in(
        self, pose: Floats, outline_px: Sequence[tuple[int, int]], camera: Calibration
    ) -> int:
        """Return the number of the building that most of what is within an outline shows, in the
        view of a camera of a robot at `pose` (3,) in the world; NOTHING if most shows none.

        Measured on 1842 percepts of two towns, that agrees with what was rendered for 0.976, and
        for all of the 1319 of which four fifths are one building.
        """
        if not self.names or len(outline_px) < MIN_CORNERS:
            return NOTHING

        columns, rows = _within(outline_px, camera).T
        right = (columns - camera.cx_px) / camera.fx_px
        down = (rows - camera.cy_px) / camera.fy_px
        falls = down / np.hypot(right, 1)
        from_m = transform_from(pose, np.array([camera.mount_forward_m, 0.0]))
        walls = self._walls
        crossings = crossings_of(walls.starts_m, walls.ends_m, from_m, pose[2] - np.arctan(right))

        above_m = camera.mount_height_m - falls[:, None] * crossings.range_m
        range_m = np.where(above_m <= walls.tops_m(crossings.share), crossings.range_m, np.inf)
        is_hit = np.isfinite(range_m.min(axis=1))
        counts = np.bincount(walls.owners[range_m.argmin(axis=1)[is_hit]], minlength=1)
        return int(counts.argmax()) if 2 * counts.max() >= len(columns) else NOTHING


def _within(outline_px: Sequence[tuple[int, int]], camera: Calibration) -> Floats:
    """Return up to about SAMPLES pixels within an outline, column and row, (k, 2)."""
    mask = np.zeros((camera.height_px, camera.width_px), np.uint8)
    cv2.fillPoly(mask, [np.array(outline_px, np.int32)], 1)
    rows, columns = np.nonzero(mask)
    every = max(1, len(rows) // SAMPLES)
    return np.column_stack([columns, rows])[::every].astype(np.float64)


def _outline_m(building: Building) -> Floats:
    """Return the (n, 2) corners of a building's footprint."""
    if building.outline_m:
        return np.array(building.outline_m, np.float64)

    pose = np.array([building.pose.x_m, building.pose.y_m, building.pose.heading_rad])
    return transform_from(pose, CORNERS * (building.width_m, building.depth_m))


def _walls_of(number: int, building: Building) -> Walls:
    """Return the walls of the building of that number, and what is below its ridge."""
    starts_m = _outline_m(building)
    ends_m = np.roll(starts_m, -1, axis=0)
    count = len(starts_m)
    rise_m = 0.0 if building.outline_m else building.roof_rise_m
    eaves_m = np.full(count, building.height_m - rise_m)
    gables_m = np.zeros(count)
    if rise_m > 0:
        # The walls of a rectangle run along the width, and every other one is a gable.
        gables_m[1::2] = rise_m
        ridge_m = (starts_m[1::2] + ends_m[1::2]) / 2
        starts_m = np.vstack([starts_m, ridge_m[:1]])
        ends_m = np.vstack([ends_m, ridge_m[1:]])
        eaves_m = np.append(eaves_m, building.height_m)
        gables_m = np.append(gables_m, 0.0)

    return Walls(starts_m, ends_m, eaves_m, gables_m, np.full(len(starts_m), number))


def _together(walls: Sequence[Walls]) -> Walls:
    """Return all of the walls in a row."""
    none = Walls(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0, int))
    starts_m, ends_m, eaves_m, gables_m, owners = zip(none, *walls, strict=True)
    return Walls(
        starts_m=np.vstack(starts_m),
        ends_m=np.vstack(ends_m),
        eaves_m=np.concatenate(eaves_m),
        gables_m=np.concatenate(gables_m),
        owners=np.concatenate(owners),
    )


def _holds(outline_m: Floats, point_m: Floats) -> bool:
    """Decide whether a point (2,) is within an outline (n, 2)."""
    x_m, y_m = point_m.tolist()
    side = cv2.pointPolygonTest(outline_m.astype(np.float32), (x_m, y_m), measureDist=False)
    return side >= 0
