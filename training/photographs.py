"""Street photographs with label images, as in CamVid (Brostow, Fauqueur & Cipolla 2009), and how
well road is found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes
from services.epam.layout.road import load

ROAD = 3
UNLABELLED = 11


@dataclass(frozen=True, eq=False)
class Photograph:
    """An RGB image (h, w, 3), which of its pixels show road, and for which of them that is known,
    (h, w) each.
    """

    name: str
    image: Bytes
    road: npt.NDArray[np.bool_]
    known: npt.NDArray[np.bool_]


def photographs(images: Path, labels: Path) -> Iterator[Photograph]:
    """Each PNG in the folder `images` with the label image of the same name in `labels`, by name.

    Raises UsageError where a folder or file is missing, no image, or of another size than its
    label.
    """
    for folder in (images, labels):
        if not folder.is_dir():
            raise UsageError(f"there is no folder {folder}: name the one that holds the PNG files")
    paths = sorted(images.glob("*.png"))
    if not paths:
        raise UsageError(
            f"no *.png in {images}: put street photographs there, and their labels in {labels}"
        )
    for path in paths:
        label_path = labels / path.name
        if not label_path.is_file():
            raise UsageError(f"{path} has no label {label_path}: add it or take the image out")
        image = _read(path, cv2.IMREAD_COLOR)
        label = _read(label_path, cv2.IMREAD_UNCHANGED)
        if label.shape != image.shape[:2] or label.dtype != np.uint8:
            raise UsageError(
                f"the label {label_path} is {label.dtype} {label.shape}, where uint8 {image.shape[:2]} fits its image: "
                "make it anew from the labels of that image"
            )
        rgb = cv2.cvtColor(image, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)
        yield Photograph(path.stem, rgb, label == ROAD, label != UNLABELLED)


def camvid_iou(weights: Path, images: Path, labels: Path) -> float:
    """Of all pixels in the photographs that are labelled or taken for road, the share that are
    both.

    Raises UsageError where the photographs cannot be read, or none of them shows road, ConfigError
    where `weights` hold no road network.
    """
    roads = load(weights)
    both = either = 0
    for photograph in photographs(images, labels):
        found = roads.mask(photograph.image)
        both += int(np.count_nonzero(found & photograph.road & photograph.known))
        either += int(np.count_nonzero((found | photograph.road) & photograph.known))
    if not either:
        raise UsageError(
            f"no pixel in {labels} is labelled {ROAD}, road: are these CamVid's labels in 12 classes?"
        )
    return both / either


def _read(path: Path, flags: int) -> npt.NDArray[Any]:
    data = np.fromfile(path, np.uint8)
    values = cv2.imdecode(data, flags) if data.size else None
    if values is None:
        raise UsageError(f"{path} is no image that can be read: put a PNG in its place")
    return values
