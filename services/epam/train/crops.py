"""The segments of renderings, each with the building that it shows, as the recogniser is trained on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.epam.objects import CHANNELS, SIDE_PX, crop
from services.epam.segments import Segment, Segmenter
from services.epam.train.renderings import Town

LEAST_OVERLAP = 0.5
FARTHEST_M = 65.0


@dataclass(frozen=True, eq=False)
class Crops:
    """`seen` float16 (n, CHANNELS, SIDE_PX, SIDE_PX); of each its `name`, the town and view that it is from, and the
    direction (rad) and distance (m) from the building to the camera."""

    seen: npt.NDArray[np.float16]
    name: npt.NDArray[np.str_]
    view: npt.NDArray[np.int64]
    direction_rad: npt.NDArray[np.float64]
    distance_m: npt.NDArray[np.float64]
    area_px: npt.NDArray[np.int64]


def overlap(segment: Segment, label: npt.NDArray[np.uint8]) -> tuple[int, float]:
    """The building that a segment shows most of, and the share of both that is common (intersection over union)."""
    count = np.bincount(label[segment.mask], minlength=2)
    count[0] = 0
    number = int(count.argmax())
    union = segment.area_px + int((label == number).sum()) - int(count[number])
    return number, float(count[number] / max(union, 1))


def crops(towns: Iterable[Town], segmenter: Segmenter) -> Crops:
    """Every segment of every view that shows a building."""
    rows = [row for index, town in enumerate(towns) for row in _of_town(index, town, segmenter)]
    seen, name, view, direction, distance, area = zip(*rows, strict=True)
    return Crops(
        np.asarray(seen).reshape(-1, CHANNELS, SIDE_PX, SIDE_PX),
        np.asarray(name),
        np.asarray(view),
        np.asarray(direction),
        np.asarray(distance),
        np.asarray(area),
    )


def _of_town(index: int, town: Town, segmenter: Segmenter) -> Iterator[tuple[object, ...]]:
    camera = town.calibration
    for number in range(len(town.left)):
        image, depth_m, label = town.left[number], town.stereo_m[number], town.label[number]
        for segment in segmenter.segments(image, depth_m, camera):
            building, share = overlap(segment, label)
            if not building or share < LEAST_OVERLAP:
                continue
            off = town.pose[number, :2] - town.place_m[building - 1]
            distance_m = float(np.hypot(*off))
            if distance_m < FARTHEST_M:
                values = crop(image, depth_m, segment.mask, segment.box_px, camera.fx_px).astype(np.float16)
                place = float(np.arctan2(off[1], off[0])), distance_m, segment.area_px
                yield values, town.names[building - 1], 1000 * index + number, *place
