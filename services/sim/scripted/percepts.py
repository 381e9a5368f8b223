"""Percepts without pictures: what EPAM would say of a view, with the errors that it was measured to
make. Pure.

Kilometres of streets, and thousands of runs, then need no rendering. The errors are those of the
perception benchmark on towns that nothing was trained on (`docs/perception.md`); its figures are
named beside each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np

from schemas.sensing import Percept, PlaceMatch, Pose

Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Positive = Annotated[float, msgspec.Meta(gt=0, le=1e4)]
Metres = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
NORMAL_MEDIAN = 0.6745
ALIKE_M = 3.0
ALIKE_RAD = 0.35
SEQUENCE = 4
RECENT = 20


class Landmark(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A building that perception knows by name: where its centre is, how wide and high it looks."""

    name: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
    x_m: Metres
    y_m: Metres
    width_m: Positive = 10.0
    height_m: Positive = 8.0


class PerceptErrors(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How perception errs, view by view.

    | field | what | from | |---|---|---| | `detected` | a building in view is found |
    `detect_recall` | | `right_name` | what is found has its own name, not another's | `top1` | |
    `precision` | what is found is a building | `detect_precision` | | `named_phantoms` | what is
    none passes for a known one all the same | top1's misses, as for buildings | | `range_sd_share`
    | standard deviation of range by range | `depth_error`, a median, / 0.6745 | | `bearing_sd_rad`
    | standard deviation of bearing | assumed; `services/epam/geometry.py` claims 0.003 at least | |
    `place_recall` | a place is known again, coming the same way | `sequence_recall_at_99p` | |
    `place_precision` | it is that place and no other | the precision at which that recall was
    measured |
    """

    detected: Share = 0.959
    right_name: Share = 0.974
    precision: Annotated[float, msgspec.Meta(gt=0, le=1)] = 0.968
    named_phantoms: Share = 0.026
    range_sd_share: Share = 0.017 / NORMAL_MEDIAN
    bearing_sd_rad: Positive = 0.01
    place_recall: Share = 0.965
    place_precision: Share = 0.99
    nearest_m: Positive = 5.0
    farthest_m: Positive = 60.0
    field_of_view_rad: Positive = math.radians(75)


class PerceptSense:
    """Sees `landmarks` from true poses, always the same from the same seed."""

    def __init__(self, errors: PerceptErrors, landmarks: Sequence[Landmark], seed: int) -> None:
        self._errors = errors
        self._landmarks = landmarks
        self._where = np.array([(each.x_m, each.y_m) for each in landmarks], float).reshape(-1, 2)
        self._rng = np.random.default_rng([seed, 0x9E])

    def in_view(self, pose: Pose) -> list[int]:
        """The landmarks that stand in the field of view and within range, whatever else may hide
        them.
        """
        errors = self._errors
        off = self._where - (pose.x_m, pose.y_m)
        distance = np.hypot(off[:, 0], off[:, 1])
        bearing = (
            np.remainder(np.arctan2(off[:, 1], off[:, 0]) - pose.heading_rad + np.pi, 2 * np.pi)
            - np.pi
        )
        near = (distance >= errors.nearest_m) & (distance <= errors.farthest_m)
        seen: list[int] = np.flatnonzero(
            near & (np.abs(bearing) <= errors.field_of_view_rad / 2)
        ).tolist()
        return seen

    def see(self, pose: Pose, visible: Sequence[int]) -> list[Percept]:
        """Percepts of the landmarks that are `visible` from `pose`, one a name at most, the first
        that got it.
        """
        errors = self._errors
        rng = self._rng
        said: dict[str, Percept] = {}
        for number in visible:
            off_x, off_y = self._where[number] - (pose.x_m, pose.y_m)
            if rng.random() < errors.detected:
                bearing = math.remainder(math.atan2(off_y, off_x) - pose.heading_rad, math.tau)
                label = self._named(number)
                said.setdefault(
                    label, self._percept(label, number, math.hypot(off_x, off_y), bearing)
                )
            if rng.random() < (1 / errors.precision - 1) * errors.named_phantoms:
                phantom = int(rng.integers(len(self._landmarks)))
                label = self._landmarks[phantom].name
                range_m = float(rng.uniform(errors.nearest_m, errors.farthest_m))
                half = errors.field_of_view_rad / 2
                said.setdefault(
                    label, self._percept(label, phantom, range_m, float(rng.uniform(-half, half)))
                )
        return list(said.values())

    def _named(self, number: int) -> str:
        """The landmark's name, or, by mistake, that of any other."""
        others = len(self._landmarks) - 1
        if others and self._rng.random() >= self._errors.right_name:
            number = (number + 1 + int(self._rng.integers(others))) % (others + 1)
        return self._landmarks[number].name

    def _percept(self, label: str, number: int, range_m: float, bearing_rad: float) -> Percept:
        """What is said of landmark `number`, so far away and in that direction, noise added."""
        errors = self._errors
        landmark = self._landmarks[number]
        sd_m = max(errors.range_sd_share * range_m, 1e-3)
        return Percept(
            label=label,
            activation=errors.right_name,
            bearing_rad=math.remainder(
                float(self._rng.normal(bearing_rad, errors.bearing_sd_rad)), math.tau
            ),
            range_m=max(0.1, float(self._rng.normal(range_m, sd_m))),
            bearing_sd_rad=errors.bearing_sd_rad,
            range_sd_m=sd_m,
            width_m=landmark.width_m,
            height_m=landmark.height_m,
            whole=True,
            box_px=(0, 0, 0, 0),
        )


class PlaceSense:
    """Knows places again where the robot comes the same way a second time, by the views that lead
    up to them.
    """

    def __init__(self, errors: PerceptErrors, seed: int) -> None:
        self._errors = errors
        self._rng = np.random.default_rng([seed, 0x9F])
        self._views: list[tuple[int, int]] = []
        self._where: list[tuple[float, float, float]] = []
        self._alike = 0

    def see(self, frame: int, stamp_ns: int, pose: Pose) -> list[PlaceMatch]:
        """The remembered view that this one matches, if any; one that matches none is remembered."""
        errors = self._errors
        rng = self._rng
        before = self._nearest(frame, pose)
        self._alike = 0 if before is None else self._alike + 1
        if before is None:
            self._views.append((frame, stamp_ns))
            self._where.append((pose.x_m, pose.y_m, pose.heading_rad))
        if before is None or self._alike < SEQUENCE or rng.random() >= errors.place_recall:
            return []
        right = rng.random() < errors.place_precision
        matched, view_ns = self._views[before if right else int(rng.integers(len(self._views)))]
        return [PlaceMatch(frame=matched, view_ns=view_ns, score=errors.place_precision)]

    def _nearest(self, frame: int, pose: Pose) -> int | None:
        """The remembered view nearest to `pose` that is near enough, looks the same way and is no
        recent one.
        """
        if not self._views:
            return None
        where = np.array(self._where)
        apart = np.hypot(where[:, 0] - pose.x_m, where[:, 1] - pose.y_m)
        turned = np.abs(np.remainder(where[:, 2] - pose.heading_rad + np.pi, 2 * np.pi) - np.pi)
        recent = np.array([number for number, _ in self._views]) > frame - RECENT
        apart[(turned > ALIKE_RAD) | recent] = np.inf
        best = int(apart.argmin())
        return best if apart[best] <= ALIKE_M else None
