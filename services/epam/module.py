"""Extended PAM: recognises objects and road in a view (paper §5.1); its nodes over threshold become percepts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import cv2
import msgspec
import numpy as np

from bus.errors import MessageError
from bus.module import Module
from schemas import topics
from schemas.array import Array
from schemas.sensing import Percept, Percepts, Unit, View
from services.epam.appearance import DEFAULT_PATH, Appearance, lab, load
from services.epam.geometry import Outline, Place, locate
from services.epam.road import road
from services.epam.segmentation import Columns, Segment, columns, segments

Positive = Annotated[float, msgspec.Meta(gt=0)]
MIXED, MIXED_WHERE_HIDDEN = 2, 5


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """`model` is the file of the appearance model, the one in this package where empty.

    A node becomes a percept when its total activation, base level and current, is over `percept_threshold`. What
    fits its learned size worse than `worst_misfit` deviations, begins and ends out of sight, or stands nobody knows
    where, is not recognised.
    """

    model: str = ""
    base_level: Unit = 0.0
    percept_threshold: Unit = 0.7
    narrowest_px: Annotated[int, msgspec.Meta(ge=4, le=1000)] = 10
    worst_misfit: Positive = 2.0
    worst_range_sd_share: Positive = 0.15


class ExtendedPam:
    """Turns each view into percepts. It keeps nothing between views."""

    def __init__(self, config: Config, model: Appearance) -> None:
        cv2.setNumThreads(1)
        self._config = config
        self._model = model

    def recognise(self, view: View) -> Percepts:
        """What is in `view`, perhaps nothing. Raises MessageError where image, depth and calibration do not fit."""
        image, depth_m = _pixels(view)
        camera = view.calibration
        lab_image = lab(image)
        seen = columns(lab_image, depth_m, camera, self._model)
        candidates = [
            segment
            for segment in segments(seen, self._model)
            if segment.right - segment.left + 1 >= self._config.narrowest_px
            and (segment.left_true or segment.right_true)
        ]
        outlines = [outline(segment, seen, self._model) for segment in candidates]
        places = locate(outlines, camera)
        objects = [
            self._percept(segment, shape, place, seen)
            for segment, shape, place in zip(candidates, outlines, places, strict=True)
            if self._over_threshold(segment, place)
        ]
        road_m = Array.of(road(lab_image, depth_m, camera))
        return Percepts(stamp_ns=view.stamp_ns, frame=view.frame, objects=_one_each(objects), road_m=road_m)

    def _over_threshold(self, segment: Segment, place: Place) -> bool:
        config = self._config
        total = min(1.0, config.base_level + segment.activation)
        placed = place.misfit <= config.worst_misfit and place.range_sd_m <= config.worst_range_sd_share * place.range_m
        return total > config.percept_threshold and placed

    def _percept(self, segment: Segment, shape: Outline, place: Place, seen: Columns) -> Percept:
        span = slice(segment.left, segment.right + 1)
        top, bottom = int(np.median(seen.top_row[span])), int(np.median(seen.bottom_row[span]))
        return Percept(
            label=self._model.names[segment.name],
            activation=min(1.0, self._config.base_level + segment.activation),
            bearing_rad=place.bearing_rad,
            range_m=place.range_m,
            bearing_sd_rad=place.bearing_sd_rad,
            range_sd_m=place.range_sd_m,
            width_m=float(self._model.footprint_m[segment.name].mean()),
            height_m=float(self._model.height_m[segment.name]),
            whole=shape.left_true and shape.right_true,
            box_px=(segment.left, top, segment.right - segment.left + 1, bottom - top + 1),
        )


def outline(segment: Segment, seen: Columns, model: Appearance) -> Outline:
    """What geometry needs of a segment: its columns less those at each end where the depths of two things mix.

    Depth spreads from what is nearer over what it hides, so more is left out where the object is hidden.
    """
    spare = (segment.right - segment.left - 3) // 2
    first = segment.left + max(0, min(MIXED if segment.left_true else MIXED_WHERE_HIDDEN, spare))
    last = segment.right - max(0, min(MIXED if segment.right_true else MIXED_WHERE_HIDDEN, spare))
    inner = np.arange(first, last + 1)
    matched = inner >= seen.disparity_px[inner]
    inner = inner[matched] if matched.sum() > 3 else inner
    longer, shorter = model.footprint_m[segment.name]
    return Outline(
        columns=inner.astype(np.float64),
        disparity_px=seen.disparity_px[inner],
        left=segment.left - 0.5,
        right=segment.right + 0.5,
        left_true=segment.left_true,
        right_true=segment.right_true,
        sides_m=(float(longer), float(shorter)),
    )


def _one_each(objects: list[Percept]) -> list[Percept]:
    """Of each label the widest: what shows the same name elsewhere is a part of it, or mistaken for it."""
    widest: dict[str, Percept] = {}
    for percept in objects:
        known = widest.get(percept.label)
        if known is None or percept.box_px[2] > known.box_px[2]:
            widest[percept.label] = percept
    return list(widest.values())


def _pixels(
    view: View,
) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.uint8]], np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    size = (view.calibration.height_px, view.calibration.width_px)
    if (view.image.dtype, view.image.shape) != ("|u1", (*size, 3)):
        raise MessageError(f"view: expected a uint8 image {(*size, 3)}, got {view.image.dtype} {view.image.shape}")
    if (view.depth_m.dtype, view.depth_m.shape) != ("<f4", size):
        raise MessageError(f"view: expected float32 depth {size}, got {view.depth_m.dtype} {view.depth_m.shape}")
    depth_m = view.depth_m.numpy().astype(np.float32, copy=False)
    if min(view.calibration.fx_px, view.calibration.fy_px) < 1.0:
        raise MessageError("view: its calibration's focal lengths must be at least 1 pixel")
    if (depth_m < 0).any():
        raise MessageError("view: depth is negative")
    return view.image.numpy().astype(np.uint8, copy=False), depth_m


def build(config: Config, instance: str) -> Module:
    """The extended PAM as a module. Raises ConfigError where its model cannot be read."""
    model = load(Path(config.model) if config.model else DEFAULT_PATH)
    return Module("epam", instance).on(topics.VIEW, ExtendedPam(config, model).recognise, emits=(topics.PERCEPTS,))
