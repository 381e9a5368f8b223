"""Percepts without images: what EPAM would publish of a view, with the errors that it was measured
to make. Pure.

Kilometres of streets, and thousands of runs, then need no rendering. The errors are those of the
perception benchmark on towns that nothing was trained on (`docs/perception.md`); the description of
each setting names the benchmark's metric.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Annotated

import msgspec
import numpy as np

from cogmap.robot import CAMERA_RANGE_M
from cogmap.schemas.base import (
    PositiveMetres,
    PositiveRadians,
    PositiveShare,
    Share,
)
from cogmap.schemas.sensing import Percept, Pose
from cogmap.services.sim.trajectory import Landmark

# Mathematics: half of all normal errors are less than so many standard deviations.
NORMAL_MEDIAN = 0.6745
# A message has ranges and standard deviations above 0, whatever noise is drawn or set.
MIN_RANGE_M = 0.1
MIN_RANGE_SD_M = 1e-3
# Seeds a stream of random numbers: any number that no other stream has.
BUILDINGS = 0x9E


class PerceptErrors(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How perception errs, view by view."""

    detected: Annotated[
        Share,
        msgspec.Meta(description="Probability that a building in view is found (detect_recall)."),
    ] = 0.959
    right_name: Annotated[
        Share,
        msgspec.Meta(description="Probability that a found building gets its own name (top1)."),
    ] = 0.974
    precision: Annotated[
        PositiveShare,
        msgspec.Meta(description="Share of found things that are buildings (detect_precision)."),
    ] = 0.968
    named_phantoms: Annotated[
        Share,
        msgspec.Meta(
            description="Probability that what is no building gets a known name (1 - top1)."
        ),
    ] = 0.026
    range_sd_share: Annotated[
        Share,
        msgspec.Meta(
            description="Standard deviation of range over range (depth_error, a median, / 0.6745)."
        ),
    ] = 0.017 / NORMAL_MEDIAN
    bearing_sd_rad: Annotated[
        PositiveRadians,
        msgspec.Meta(description="Standard deviation of bearing, in rad (assumed)."),
    ] = 0.01
    place_recall: Annotated[
        Share,
        msgspec.Meta(
            description="Probability that a place passed in the same direction is recognized "
            "(sequence_recall_at_99p)."
        ),
    ] = 0.965
    place_precision: Annotated[
        Share,
        msgspec.Meta(
            description="Probability that a recognized place is the right one (the precision at "
            "which that recall was measured)."
        ),
    ] = 0.99
    road_edge_sd_m: Annotated[
        Share,
        msgspec.Meta(
            description="Standard deviation of the road's boundary, in m (road_edge_error_m, a "
            "median, / 0.6745)."
        ),
    ] = 0.058 / NORMAL_MEDIAN
    nearest_m: Annotated[
        PositiveMetres,
        msgspec.Meta(description="Least range of a percept, in m."),
    ] = 5.0
    farthest_m: Annotated[
        PositiveMetres,
        msgspec.Meta(description="Greatest range of a percept, in m."),
    ] = CAMERA_RANGE_M
    field_of_view_rad: Annotated[
        PositiveRadians,
        msgspec.Meta(description="Horizontal field of view, in rad."),
    ] = math.radians(75)


class PerceptSim:
    """Simulates percepts of `landmarks` from true poses, the same from the same seed; those of
    different `stream`s err apart.
    """

    def __init__(
        self,
        errors: PerceptErrors,
        landmarks: Sequence[Landmark],
        seed: int,
        stream: int = BUILDINGS,
    ) -> None:
        self._errors = errors
        self._landmarks = landmarks
        self._functions = {each.name: each.function for each in landmarks}
        self._rng = np.random.default_rng([seed, stream])

        places = [(each.x_m, each.y_m) for each in landmarks]
        self._places_m = np.array(places, float).reshape(-1, 2)

    def in_view(self, pose: Pose) -> list[int]:
        """Return the landmarks in the field of view and within range, whatever else may hide
        them.
        """
        x_m, y_m = (self._places_m - (pose.x_m, pose.y_m)).T
        range_m = np.hypot(x_m, y_m)
        direction_rad = np.arctan2(y_m, x_m) - pose.heading_rad
        bearing_rad = np.remainder(direction_rad + np.pi, 2 * np.pi) - np.pi

        errors = self._errors
        is_near = (range_m >= errors.nearest_m) & (range_m <= errors.farthest_m)
        is_ahead = np.abs(bearing_rad) <= errors.field_of_view_rad / 2
        numbers: list[int] = np.flatnonzero(is_near & is_ahead).tolist()
        return numbers

    def perceive(
        self, pose: Pose, visible: Sequence[int], cut: Collection[int] = ()
    ) -> list[Percept]:
        """Return percepts of the landmarks that are `visible` from `pose`, not whole of those in
        `cut`; of percepts with one name, the first.
        """
        errors = self._errors
        landmarks = self._landmarks
        phantoms_per_object = (1 / errors.precision - 1) * errors.named_phantoms

        percepts: dict[str, Percept] = {}
        for number in visible:
            if self._rng.random() < errors.detected:
                x_m, y_m = self._places_m[number] - (pose.x_m, pose.y_m)
                bearing_rad = math.remainder(math.atan2(y_m, x_m) - pose.heading_rad, math.tau)

                # By mistake it gets the name of any other.
                named = number
                if len(landmarks) > 1 and self._rng.random() >= errors.right_name:
                    shift = 1 + int(self._rng.integers(len(landmarks) - 1))
                    named = (number + shift) % len(landmarks)

                label = landmarks[named].name
                range_m = math.hypot(x_m, y_m)
                found = self._percept(label, number, range_m, bearing_rad, number not in cut)
                percepts.setdefault(label, found)

            if self._rng.random() < phantoms_per_object:
                phantom = int(self._rng.integers(len(landmarks)))
                range_m = float(self._rng.uniform(errors.nearest_m, errors.farthest_m))
                half_rad = errors.field_of_view_rad / 2
                bearing_rad = float(self._rng.uniform(-half_rad, half_rad))

                label = landmarks[phantom].name
                percepts.setdefault(label, self._percept(label, phantom, range_m, bearing_rad))

        return list(percepts.values())

    def _percept(
        self, label: str, number: int, range_m: float, bearing_rad: float, whole: bool = True
    ) -> Percept:
        """Draw landmark `number`'s percept at `range_m` and `bearing_rad`, with noise on both."""
        errors = self._errors
        landmark = self._landmarks[number]
        range_sd_m = max(errors.range_sd_share * range_m, MIN_RANGE_SD_M)
        noisy_bearing_rad = float(self._rng.normal(bearing_rad, errors.bearing_sd_rad))
        noisy_range_m = float(self._rng.normal(range_m, range_sd_m))

        return Percept(
            name=label,
            activation=errors.right_name,
            evidence=errors.right_name,
            bearing_rad=math.remainder(noisy_bearing_rad, math.tau),
            range_m=max(MIN_RANGE_M, noisy_range_m),
            bearing_sd_rad=errors.bearing_sd_rad,
            range_sd_m=range_sd_m,
            width_m=landmark.width_m,
            height_m=landmark.height_m,
            whole=whole,
            box_px=(0, 0, 0, 0),
            function=self._functions[label],
        )
