"""Street photographs with label images, as in CamVid (Brostow, Fauqueur & Cipolla 2009), and the
road network's IoU on them.
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
from cogmap.geometry.arrays import Booleans, Bytes
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
    road: Booleans
    known: Booleans


def photographs(images: Path, labels: Path) -> Iterator[Photograph]:
    """Return each PNG in the folder `images` with the label image of the same name in `labels`, by
    name.

    Raises UsageError if a folder or file is missing, is no image, or has another size than its
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
        yield _photograph(path, labels / path.name)


def _photograph(path: Path, label_path: Path) -> Photograph:
    if not label_path.is_file():
        raise UsageError(f"{path} has no label {label_path}: add it or take the image out")

    image = _read(path, cv2.IMREAD_COLOR)
    label = _read(label_path, cv2.IMREAD_UNCHANGED)
    size = image.shape[:2]
    if label.shape != size or label.dtype != np.uint8:
        raise UsageError(
            f"the label {label_path} is {label.dtype} {label.shape}, where uint8 {size} fits its "
            "image: make it anew from the labels of that image"
        )

    rgb = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return Photograph(
        name=path.stem,
        image=rgb.astype(np.uint8, copy=False),
        road=label == ROAD,
        known=label != UNLABELLED,
    )


def camvid_iou(weights: Path, images: Path, labels: Path) -> float:
    """Return the intersection over union of road, as found and as labelled, over all labelled
    pixels.

    Raises UsageError if the photographs cannot be read or none of them shows road, ConfigError if
    `weights` hold no road network.
    """
    segmenter = load(weights)
    both = 0
    either = 0
    for photograph in photographs(images, labels):
        found = segmenter.mask(photograph.image)
        both += int(np.count_nonzero(found & photograph.road & photograph.known))
        either += int(np.count_nonzero((found | photograph.road) & photograph.known))

    if not either:
        raise UsageError(
            f"no pixel in {labels} is labelled {ROAD}, road: are these CamVid's labels in 12 "
            "classes?"
        )
    return both / either


def _read(path: Path, flags: int) -> npt.NDArray[Any]:
    data = np.fromfile(path, np.uint8)
    values = cv2.imdecode(data, flags) if data.size else None
    if values is None:
        raise UsageError(f"{path} is no image that can be read: put a PNG in its place")
    return values
