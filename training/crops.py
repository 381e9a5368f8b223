"""The segments of renderings, each with the building that it shows, to train and calibrate object
recognition on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from cogmap.geometry.arrays import Booleans, Bytes
from cogmap.services.epam.recognition.crop import CHANNELS, SIDE_PX, crop, surroundings
from cogmap.services.epam.recognition.segments import Segment, Segmenter
from cogmap.training.rendering.reader import Town

MIN_OVERLAP = 0.5
MIN_PURITY = 0.5
VIEWS_A_TOWN = 1000


@dataclass(frozen=True, eq=False)
class Crops:
    """Network inputs `values`, float16 (n, CHANNELS, SIDE_PX, SIDE_PX), and (n,) of each: the
    `name` of the building that it shows, empty for none; whether it is most of what is visible of
    that building; the number of its view, which is VIEWS_A_TOWN times that of its town and more;
    and its area.
    """

    values: npt.NDArray[np.float16]
    name: npt.NDArray[np.str_]
    whole: Booleans
    view: npt.NDArray[np.int64]
    area_px: npt.NDArray[np.int64]


class _Row(NamedTuple):
    """One of Crops."""

    values: npt.NDArray[np.float16]
    name: str
    whole: bool
    view: int
    area_px: int


def overlap(segment: Segment, label: Bytes) -> tuple[int, float]:
    """Return the number of the building in `label` (h, w) that most of `segment` shows, and the
    intersection over union of the two.
    """
    number, common_px = main_building(segment, label)
    building_px = int(np.count_nonzero(label == number))
    union_px = segment.area_px + building_px - common_px
    return number, common_px / max(union_px, 1)


def crops(towns: Iterable[Town], segmenter: Segmenter) -> Crops:
    """Return every segment of every view."""
    rows: list[_Row] = []
    for index, town in enumerate(towns):
        rows += _of_town(index, town, segmenter)

    values = np.asarray([row.values for row in rows])
    return Crops(
        values=values.reshape(-1, CHANNELS, SIDE_PX, SIDE_PX),
        name=np.asarray([row.name for row in rows]),
        whole=np.asarray([row.whole for row in rows]),
        view=np.asarray([row.view for row in rows]),
        area_px=np.asarray([row.area_px for row in rows]),
    )


def _of_town(index: int, town: Town, segmenter: Segmenter) -> Iterator[_Row]:
    camera = town.calibration
    for number in range(len(town.left)):
        image = town.left[number]
        depth_m = town.stereo_m[number]
        label = town.label[number]
        around = surroundings(image, depth_m, camera)

        for segment in segmenter.segments(image, depth_m, camera):
            values = crop(image, depth_m, segment, around, camera.fx_px)
            building, common_px = main_building(segment, label)
            is_pure = common_px >= MIN_PURITY * segment.area_px
            _, share = overlap(segment, label)
            yield _Row(
                values=values.astype(np.float16),
                name=town.names[building - 1] if is_pure else "",
                whole=share >= MIN_OVERLAP,
                view=VIEWS_A_TOWN * index + number,
                area_px=segment.area_px,
            )


def main_building(segment: Segment, label: Bytes) -> tuple[int, int]:
    """Return the number in `label` (h, w) of the building that most pixels of `segment` show, and
    how many do; 0 pixels if none does.
    """
    count = np.bincount(label[segment.mask], minlength=2)
    count[0] = 0
    number = int(count.argmax())
    return number, int(count[number])
