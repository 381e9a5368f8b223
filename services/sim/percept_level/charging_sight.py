"""Percepts of charging places, with the errors of perception. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.robot import NEAREST_DEPTH_M
from cogmap.schemas.nodes import ENERGY, SATISFIED_BY
from cogmap.schemas.sensing import Percept, Pose
from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.percept_level.column_camera import NEAR_M, WHOLE_SHARE, ColumnCamera
from cogmap.services.sim.percept_level.percepts import PerceptErrors, PerceptSim
from cogmap.services.sim.trajectory import Landmark

FARTHEST_M = 30.0
"""Beyond this a post is a pixel or two wide."""

MIN_SHARE = 0.5
"""A post is seen if walls hide less than the rest of its width."""

_STREAM = 0xC5


class ChargingSight:
    """Sees the posts of `places` that no wall hides: missed, displaced and imagined as buildings
    are, and not taken for one, nor one for them.
    """

    def __init__(
        self, places: Sequence[Prop], errors: PerceptErrors, camera: ColumnCamera, seed: int
    ) -> None:
        self._camera = camera
        self._corners_m = [np.array(place.seen) for place in places]

        landmarks = []
        for place in places:
            _, width_m, height_m = place.size_m
            landmark = Landmark(
                name=place.kind,
                x_m=place.x_m,
                y_m=place.y_m,
                width_m=width_m,
                height_m=height_m,
                function=SATISFIED_BY[ENERGY],
            )
            landmarks.append(landmark)

        nearer = msgspec.structs.replace(
            errors,
            nearest_m=min(NEAREST_DEPTH_M, errors.nearest_m),
            farthest_m=min(FARTHEST_M, errors.farthest_m),
        )
        self._percepts = PerceptSim(nearer, landmarks, seed, _STREAM)

    def look(self, pose: Pose, inverse_m: Floats) -> list[Percept]:
        """Return what is seen from a pose; the walls have these inverse depths, (width,)."""
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])
        border = self._camera.width - 1

        visible = []
        cut = []
        for number in self._percepts.in_view(pose):
            forward_m, left_m = self._camera.seen_from(at, self._corners_m[number]).T
            nearest_m = float(forward_m.min())
            if nearest_m < NEAR_M:
                continue

            column = self._camera.column(forward_m, left_m)
            first = round(float(column.min()))
            last = round(float(column.max()))
            walls = inverse_m[max(0, first) : min(border, last) + 1]
            share = float((walls * nearest_m < 1.0).mean()) if len(walls) else 0.0
            if share < MIN_SHARE:
                continue

            visible.append(number)
            if first <= 0 or last >= border or share < WHOLE_SHARE:
                cut.append(number)

        return self._percepts.perceive(pose, visible, cut)
