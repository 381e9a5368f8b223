"""The segments of renderings, each with the building that it shows, as the recogniser is trained on
them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.epam.recognition.crop import CHANNELS, SIDE_PX, crop, surroundings
from services.epam.recognition.segments import Segment, Segmenter
from training.renderings import Town

LEAST_OVERLAP = 0.5
LEAST_PURE = 0.5


@dataclass(frozen=True, eq=False)
class Crops:
    """`seen` float16 (n, CHANNELS, SIDE_PX, SIDE_PX); of each the `name` of the building that it
    shows, empty for none, whether it is most of what can be seen of that, the town and view that it
    is from, and how many pixels it has.
    """

    seen: npt.NDArray[np.float16]
    name: npt.NDArray[np.str_]
    whole: npt.NDArray[np.bool_]
    view: npt.NDArray[np.int64]
    area_px: npt.NDArray[np.int64]


def overlap(segment: Segment, label: npt.NDArray[np.uint8]) -> tuple[int, float]:
    """The building that a segment shows most of, and the share of both that is common (intersection
    over union).
    """
    count = np.bincount(label[segment.mask], minlength=2)
    count[0] = 0
    number = int(count.argmax())
    union = segment.area_px + int((label == number).sum()) - int(count[number])
    return number, float(count[number] / max(union, 1))


def crops(towns: Iterable[Town], segmenter: Segmenter) -> Crops:
    """Every segment of every view."""
    rows = [row for index, town in enumerate(towns) for row in _of_town(index, town, segmenter)]
    seen, name, whole, view, area = zip(*rows, strict=True)
    return Crops(
        np.asarray(seen).reshape(-1, CHANNELS, SIDE_PX, SIDE_PX),
        np.asarray(name),
        np.asarray(whole),
        np.asarray(view),
        np.asarray(area),
    )


def _of_town(index: int, town: Town, segmenter: Segmenter) -> Iterator[tuple[object, ...]]:
    camera = town.calibration
    for number in range(len(town.left)):
        image = town.left[number]
        depth_m = town.stereo_m[number]
        label = town.label[number]
        around = surroundings(image, depth_m, camera)
        for segment in segmenter.segments(image, depth_m, camera):
            values = crop(image, depth_m, segment, around, camera.fx_px).astype(np.float16)
            whole = overlap(segment, label)[1] >= LEAST_OVERLAP
            yield (
                values,
                _shown(segment, label, town.names),
                whole,
                1000 * index + number,
                segment.area_px,
            )


def _shown(segment: Segment, label: npt.NDArray[np.uint8], names: tuple[str, ...]) -> str:
    """The building that LEAST_PURE of the segment shows; a segment of less shows none."""
    count = np.bincount(label[segment.mask], minlength=2)
    count[0] = 0
    most = int(count.argmax())
    return names[most - 1] if count[most] >= LEAST_PURE * segment.area_px else ""
