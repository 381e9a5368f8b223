"""What sensory memory and EPAM would publish of a place, from a true pose: computed from the ground
plan, with the errors that they were measured to make. Pure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cogmap.geometry.arrays import Floats, Singles
from cogmap.robot import CAMERA_RANGE_M, NEAREST_DEPTH_M
from cogmap.schemas.sensing import Calibration, Percept, Pose
from cogmap.services.sim.driven.camera import NEAR_M, NOTHING, Buffer, ColumnCamera, depths_m
from cogmap.services.sim.driven.charging_sight import ChargingSight
from cogmap.services.sim.driven.ground import Lattice, boundary_points_m, road_points_m, thin
from cogmap.services.sim.driven.surroundings import Near
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import Plot
from cogmap.services.sim.scripted.percepts import Landmark, PerceptErrors, PerceptSim

SECTORS = 32
# A building is seen where so many columns show it, and whole where so large a part of it is seen.
MIN_COLUMNS = 8
WHOLE_SHARE = 0.9
# How much of the error of the road's boundary is the same all over one view.
COMMON_SHARE = 0.5


class View(NamedTuple):
    """What is seen: a range scan, (SECTORS,) each; points of the road and its boundary, (n, 2), in
    the robot's frame; and objects.
    """

    bearing_rad: Singles
    range_m: Singles
    road_m: Singles
    boundary_m: Singles
    objects: list[Percept]


class Sensors:
    """Range scan, road and objects of a place, the same from the same seed."""

    def __init__(self, place: Place, errors: PerceptErrors, mount: Calibration, seed: int) -> None:
        self._errors = errors
        self._camera = ColumnCamera(mount)
        self._lattice = Lattice(self._camera)
        self._rng = np.random.default_rng([seed, 0x5C])

        self._corners_m = [np.array(plot.corners) for plot in place.plots]
        landmarks = [_landmark(plot) for plot in place.plots]
        self._percepts = PerceptSim(errors, landmarks, seed)
        self._charging = ChargingSight(place.charging_places, errors, self._camera, seed)

    def look(self, pose: Pose, near: Near) -> View:
        """All that is seen from a pose, of what is near it."""
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        walls = self._camera.nearest(at, near.walls_m)
        obstacles = self._camera.nearest(at, near.obstacles_m)
        depth_m = depths_m(np.maximum(walls.inverse_m, obstacles.inverse_m))

        bearing_rad, range_m = self._scan(depth_m)
        road_m, boundary_m = self._ground(at, depth_m, near)

        buildings = self._objects(pose, at, walls, near)
        return View(
            bearing_rad=bearing_rad,
            range_m=range_m,
            road_m=road_m,
            boundary_m=boundary_m,
            objects=buildings + self._charging.look(pose, walls.inverse_m),
        )

    def _scan(self, depth_m: Floats) -> tuple[Singles, Singles]:
        """Bearing and range of the nearest in each sector, range 0 where there is nothing."""
        middle_rad, nearest_m = scan(self._camera, depth_m)
        factor = self._rng.normal(1.0, self._errors.range_sd_share, SECTORS)
        noisy_m = nearest_m * factor

        return middle_rad.astype(np.float32), noisy_m.astype(np.float32)

    def _ground(self, at: Floats, depth_m: Floats, near: Near) -> tuple[Singles, Singles]:
        """Points of the road and of its boundary. Both are seen beside their place by one error;
        each point of the boundary has one of its own.
        """
        sd_m = self._errors.road_edge_sd_m
        common_m = self._rng.normal(0.0, sd_m * math.sqrt(COMMON_SHARE), 2)
        road_m = road_points_m(self._lattice, at, depth_m, near.streets, common_m)

        seen_m = boundary_points_m(self._camera, at, depth_m, near.kerbs_m, common_m)
        thinned_m = thin(seen_m)

        own_sd_m = sd_m * math.sqrt(1 - COMMON_SHARE)
        own_m = self._rng.normal(0.0, own_sd_m, thinned_m.shape)
        boundary_m = thinned_m + own_m
        return road_m, boundary_m.astype(np.float32)

    def _objects(self, pose: Pose, at: Floats, walls: Buffer, near: Near) -> list[Percept]:
        """Percepts of the buildings that no other hides."""
        segment = walls.segment[walls.segment != NOTHING]
        shown = near.plot[segment]
        columns = np.bincount(shown, minlength=len(self._corners_m))

        visible = []
        cut = []
        for number in self._percepts.in_view(pose):
            if columns[number] < MIN_COLUMNS:
                continue

            visible.append(number)
            if self._is_cut(at, number, int(columns[number])):
                cut.append(number)

        return self._percepts.perceive(pose, visible, cut)

    def _is_cut(self, at: Floats, number: int, columns: int) -> bool:
        """Whether the image's border or another building cuts a building that `columns` show."""
        corners_m = self._camera.seen_from(at, self._corners_m[number])
        forward_m, left_m = corners_m.T
        if forward_m.min() < NEAR_M:
            return True

        column = self._camera.column(forward_m, left_m)
        leftmost = float(column.min())
        rightmost = float(column.max())
        if leftmost < 1 or rightmost > self._camera.width - 2:
            return True

        return columns < WHOLE_SHARE * (rightmost - leftmost)


def scan(camera: ColumnCamera, depth_m: Floats) -> tuple[Floats, Floats]:
    """(SECTORS,) each: the middle bearing of each sector, from the left, and the range of the
    nearest in it, 0 where there is nothing; both from the robot's origin. `depth_m` (width,) is
    that of each image column.
    """
    is_measured = depth_m <= CAMERA_RANGE_M
    # Stereo matching takes what is nearer for as near as this.
    seen_m = np.maximum(depth_m[is_measured], NEAREST_DEPTH_M)
    forward_m = seen_m + camera.mount.mount_forward_m
    left_m = camera.left_slope[is_measured] * seen_m
    range_m = np.hypot(forward_m, left_m)
    bearing_rad = np.arctan2(left_m, forward_m)

    half_rad = camera.half_field_of_view_rad
    sector_rad = 2 * half_rad / SECTORS
    from_left_rad = half_rad - bearing_rad
    sector = np.floor(from_left_rad / sector_rad).astype(np.int64)

    nearest_m: Floats = np.full(SECTORS, np.inf)
    np.minimum.at(nearest_m, sector.clip(0, SECTORS - 1), range_m)
    nearest_m[np.isinf(nearest_m)] = 0.0

    middles = np.arange(SECTORS, dtype=float) + 0.5
    return half_rad - middles * sector_rad, nearest_m


def _landmark(plot: Plot) -> Landmark:
    """A building as a landmark: it seems about as wide as its front is."""
    kind = plot.kind
    return Landmark(
        name=kind.name,
        x_m=plot.x_m,
        y_m=plot.y_m,
        width_m=kind.width_m,
        height_m=kind.height_m,
        function=plot.function,
    )
