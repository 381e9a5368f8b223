"""Percepts of charging places, with the errors of perception. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from cogmap.geometry.arrays import Floats
from cogmap.robot import NEAREST_DEPTH_M
from cogmap.schemas.nodes import ENERGY, SATISFIED_BY
from cogmap.schemas.sensing import Percept, Pose
from cogmap.services.sim.driven.camera import NEAR_M, ColumnCamera
from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.scripted.percepts import Landmark, PerceptErrors, PerceptSim

FUNCTION = SATISFIED_BY[ENERGY]
FARTHEST_M = 30.0
# So much of a post must be seen past the walls, and so much of a whole one.
MIN_SHARE = 0.5
WHOLE_SHARE = 0.9
_STREAM = 0xC5


class Seen(NamedTuple):
    """The share of a post's width that no wall hides, and whether all of it is in the image."""

    share: float
    is_inside: bool


class ChargingSight:
    """Sees the posts of `places` that no wall hides: missed, displaced and imagined as buildings
    are, and not taken for one, nor one for them.
    """

    def __init__(
        self, places: Sequence[Prop], errors: PerceptErrors, camera: ColumnCamera, seed: int
    ) -> None:
        self._camera = camera
        self._corners_m = [np.array(place.seen) for place in places]

        nearer = msgspec.structs.replace(
            errors,
            nearest_m=min(NEAREST_DEPTH_M, errors.nearest_m),
            farthest_m=min(FARTHEST_M, errors.farthest_m),
        )
        landmarks = [_landmark(place) for place in places]
        self._percepts = PerceptSim(nearer, landmarks, seed, _STREAM)

    def look(self, pose: Pose, inverse_m: Floats) -> list[Percept]:
        """What is seen from a pose, where the walls have these inverse depths, (width,)."""
        at = np.array([pose.x_m, pose.y_m, pose.heading_rad])

        visible = []
        cut = []
        for number in self._percepts.in_view(pose):
            seen = self._seen(at, number, inverse_m)
            if seen.share < MIN_SHARE:
                continue

            visible.append(number)
            if not seen.is_inside or seen.share < WHOLE_SHARE:
                cut.append(number)

        return self._percepts.perceive(pose, visible, cut)

    def _seen(self, at: Floats, number: int, inverse_m: Floats) -> Seen:
        forward_m, left_m = self._camera.seen_from(at, self._corners_m[number]).T
        nearest_m = float(forward_m.min())
        if nearest_m < NEAR_M:
            return Seen(0.0, False)

        column = self._camera.column(forward_m, left_m)
        first = round(float(column.min()))
        last = round(float(column.max()))
        border = self._camera.width - 1
        shown = inverse_m[max(0, first) : min(border, last) + 1]
        if not len(shown):
            return Seen(0.0, False)

        is_nearer = shown * nearest_m < 1.0
        return Seen(float(is_nearer.mean()), first > 0 and last < border)


def _landmark(place: Prop) -> Landmark:
    _, width_m, height_m = place.size_m
    return Landmark(
        name=place.kind,
        x_m=place.x_m,
        y_m=place.y_m,
        width_m=width_m,
        height_m=height_m,
        function=FUNCTION,
    )
