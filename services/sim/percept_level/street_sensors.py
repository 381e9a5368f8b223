"""A network of streets as percepts: landmarks along them, and their surface. Pure."""

from __future__ import annotations

import math
from collections.abc import Collection

import msgspec
import numpy as np

from cogmap.geometry.polylines import nearest_on_pieces
from cogmap.schemas.sensing import Calibration, Pose, TrueTown
from cogmap.services.sim.layout.network import StreetNetwork
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.percept_level.column_camera import ColumnCamera
from cogmap.services.sim.percept_level.ground import Lattice, road_points_m
from cogmap.services.sim.percept_level.line_sensors import (
    NOTHING,
    STREET_HALF_WIDTH_M,
    buildings_of,
    line_of_sight_m,
)
from cogmap.services.sim.percept_level.percepts import PerceptErrors, PerceptSim
from cogmap.services.sim.percept_level.senses import View
from cogmap.services.sim.percept_level.surroundings import Surroundings
from cogmap.services.sim.percept_level.town_sensors import COMMON_SHARE


class StreetSensors:
    """Sees the landmarks that no house hides, as beside a line: a line of sight that leaves the
    streets meets one. The surface of the streets ahead is seen as a town's is; the range scan is
    empty, and no boundary is seen.
    """

    def __init__(
        self,
        network: StreetNetwork,
        place: Place,
        surroundings: Surroundings,
        errors: PerceptErrors,
        mount: Calibration,
        *,
        seed: int,
    ) -> None:
        self._network = network
        self._place = place
        self._surroundings = surroundings
        self._error_sd_m = errors.road_edge_sd_m * math.sqrt(COMMON_SHARE)
        self._lattice = Lattice(ColumnCamera(mount))
        self._unhidden_m = np.full(mount.width_px, np.inf)
        self._rng = np.random.default_rng([seed, 0x57])
        self._percepts = PerceptSim(errors, network.landmarks, seed)

        pieces_m = np.array(network.pieces_m, float)
        self._starts_m = pieces_m[:, :2]
        self._ends_m = pieces_m[:, 2:]
        landmarks_m = [(each.x_m, each.y_m) for each in network.landmarks]
        at_m = np.array(landmarks_m, float).reshape(-1, 2)
        self._fronts_m = nearest_on_pieces(self._starts_m, self._ends_m, at_m).foot_m

    def look(self, pose: Pose) -> View:
        """Return the landmarks in view, and points of the streets ahead."""
        eye_m = np.array([pose.x_m, pose.y_m])
        visible = []
        for number in self._percepts.in_view(pose):
            sight_m = line_of_sight_m(eye_m, self._fronts_m[number])
            feet_m = nearest_on_pieces(self._starts_m, self._ends_m, sight_m).foot_m
            if (np.hypot(*(sight_m - feet_m).T) <= STREET_HALF_WIDTH_M).all():
                visible.append(number)

        near = self._surroundings.near(pose.x_m, pose.y_m)
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        error_m = self._rng.normal(0.0, self._error_sd_m, 2)
        road_m = road_points_m(self._lattice, at, self._unhidden_m, near.streets, error_m)
        return View(
            bearing_rad=NOTHING,
            range_m=NOTHING,
            road_m=road_m,
            boundary_m=np.zeros((0, 2), np.float32),
            objects=self._percepts.perceive(pose, visible),
        )

    def change(self, closed: Collection[str], gone: Collection[int]) -> None:
        """Let barriers close these streets; no landmark is torn down."""
        self._surroundings.change(closed, ())

    def town(self, closed: Collection[str], gone: Collection[int]) -> TrueTown:
        """Return the streets as they are then, and the landmarks as buildings."""
        town = self._place.message(closed)
        return msgspec.structs.replace(town, buildings=buildings_of(self._network.landmarks))
