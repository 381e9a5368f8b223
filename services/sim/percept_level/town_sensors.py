"""A town as percepts: range scan, road and objects, computed from its ground plan with the errors
that sensory memory and EPAM were measured to make. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.robot import CAMERA_RANGE_M, NEAREST_DEPTH_M
from cogmap.schemas.sensing import Calibration, Percept, Pose, TrueTown
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.percept_level.charging_sight import ChargingSight
from cogmap.services.sim.percept_level.column_camera import (
    NEAR_M,
    NOTHING,
    WHOLE_SHARE,
    Buffer,
    ColumnCamera,
    depths_m,
)
from cogmap.services.sim.percept_level.ground import (
    Lattice,
    boundary_points_m,
    road_points_m,
    thin,
)
from cogmap.services.sim.percept_level.percepts import PerceptErrors, PerceptSim
from cogmap.services.sim.percept_level.senses import View
from cogmap.services.sim.percept_level.surroundings import Near, Surroundings
from cogmap.services.sim.trajectory import Landmark

SECTORS = 32
"""As sensory memory divides the field of view."""

MIN_COLUMNS = 8
"""A building is seen if so many image columns show it."""

COMMON_SHARE = 0.5
"""How much of the variance of the road's boundary is the same all over one view."""


class TownSensors:
    """Sees what is near in `surroundings`, the same from the same seed."""

    def __init__(
        self,
        place: Place,
        surroundings: Surroundings,
        errors: PerceptErrors,
        mount: Calibration,
        seed: int,
    ) -> None:
        self._place = place
        self._surroundings = surroundings
        self._errors = errors
        self._camera = ColumnCamera(mount)
        self._lattice = Lattice(self._camera)
        self._rng = np.random.default_rng([seed, 0x5C])

        landmarks = []
        for plot in place.plots:
            kind = plot.kind
            # A building seems about as wide as its front is.
            landmark = Landmark(
                name=kind.name,
                x_m=plot.x_m,
                y_m=plot.y_m,
                width_m=kind.width_m,
                height_m=kind.height_m,
                function=plot.function,
            )
            landmarks.append(landmark)

        self._corners_m = [np.array(plot.corners) for plot in place.plots]
        self._percepts = PerceptSim(errors, landmarks, seed)
        self._charging = ChargingSight(place.charging_places, errors, self._camera, seed)

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Let these streets be closed and these buildings be gone, and no others."""
        self._surroundings.change(closed, gone)

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the town as it is then."""
        return self._place.message(closed, gone)

    def look(self, pose: Pose) -> View:
        """Return all that is seen from a pose."""
        near = self._surroundings.near(pose.x_m, pose.y_m)
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        walls = self._camera.nearest(at, near.walls_m)
        obstacles = self._camera.nearest(at, near.obstacles_m)
        depth_m = depths_m(np.maximum(walls.inverse_m, obstacles.inverse_m))

        errors = self._errors
        middle_rad, nearest_m = scan(self._camera, depth_m)
        noisy_m = nearest_m * self._rng.normal(1.0, errors.range_sd_share, SECTORS)

        # Road and boundary are seen beside their place by one error; each point of the boundary has
        # one of its own.
        sd_m = errors.road_edge_sd_m
        common_m = self._rng.normal(0.0, sd_m * math.sqrt(COMMON_SHARE), 2)
        road_m = road_points_m(self._lattice, at, depth_m, near.streets, common_m)
        boundary_m = thin(boundary_points_m(self._camera, at, depth_m, near.kerbs_m, common_m))
        own_m = self._rng.normal(0.0, sd_m * math.sqrt(1 - COMMON_SHARE), boundary_m.shape)

        buildings = self._buildings(pose, at, walls, near)
        return View(
            bearing_rad=middle_rad.astype(np.float32),
            range_m=noisy_m.astype(np.float32),
            road_m=road_m,
            boundary_m=(boundary_m + own_m).astype(np.float32),
            objects=buildings + self._charging.look(pose, walls.inverse_m),
        )

    def _buildings(self, pose: Pose, at: Floats, walls: Buffer, near: Near) -> list[Percept]:
        """Return percepts of the buildings that no other hides. Those that the image's border or
        another building cuts are not whole.
        """
        shown = near.plot[walls.segment[walls.segment != NOTHING]]
        columns = np.bincount(shown, minlength=len(self._corners_m))

        visible = []
        cut = []
        for number in self._percepts.in_view(pose):
            if columns[number] < MIN_COLUMNS:
                continue

            visible.append(number)
            forward_m, left_m = self._camera.seen_from(at, self._corners_m[number]).T
            if forward_m.min() < NEAR_M:
                cut.append(number)
                continue

            column = self._camera.column(forward_m, left_m)
            is_at_border = column.min() < 1 or column.max() > self._camera.width - 2
            if is_at_border or columns[number] < WHOLE_SHARE * (column.max() - column.min()):
                cut.append(number)

        return self._percepts.perceive(pose, visible, cut)


def scan(camera: ColumnCamera, depth_m: Floats) -> tuple[Floats, Floats]:
    """Return (SECTORS,) each: the middle bearing of each sector, from the left, and the range of
    the nearest in it, 0 if there is nothing; both from the robot's origin. `depth_m` (width,) is
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
