"""Street photographs with label images, as in CamVid (Brostow, Fauqueur & Cipolla 2009), and the
IoU of road and of buildings on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.errors import UsageError
from cogmap.geometry.arrays import Booleans, Bytes
from cogmap.schemas.sensing import Calibration
from cogmap.services.epam.layout.road import load
from cogmap.services.epam.recognition.segments import Segmenter

BUILDING = 1
ROAD = 3
# CamVid's classes have lower numbers.
UNLABELLED = 11
# What is none of CamVid's classes, as of renderings: neither road nor building.
OTHER = 12
IMAGE_SUFFIXES = (".png", ".jpg")
# Folders with CamVid's training photographs; the first that is there is used.
TRAINING_FOLDERS = ("train_320", "train")
LABEL_SUFFIXES = ("annot", "_annot")


@dataclass(frozen=True, eq=False)
class Photograph:
    """An RGB image (h, w, 3), and the number of the class that each of its pixels shows (h, w)."""

    name: str
    image: Bytes
    label: Bytes

    @property
    def road(self) -> Booleans:
        """Return which pixels show road."""
        return np.asarray(self.label == ROAD)

    @property
    def building(self) -> Booleans:
        """Return which pixels show a building."""
        return np.asarray(self.label == BUILDING)

    @property
    def known(self) -> Booleans:
        """Return of which pixels it is known what they show."""
        return np.asarray(self.label != UNLABELLED)


def training_folders(camvid: Path) -> tuple[Path, Path]:
    """Return the folders of training photographs and of their labels in `camvid`: one of
    TRAINING_FOLDERS, or `camvid` itself; labels are in the folder beside it whose name ends in
    LABEL_SUFFIXES.

    Raises UsageError if there are no such folders.
    """
    candidates = [camvid / name for name in TRAINING_FOLDERS]
    for images in (*candidates, camvid.absolute()):
        for suffix in LABEL_SUFFIXES:
            labels = images.with_name(images.name + suffix)
            if images.is_dir() and labels.is_dir():
                return images, labels

    raise UsageError(
        f"there is no folder of photographs in {camvid} with labels beside it: put the images in "
        f"{camvid / 'train'} and their label images in {camvid / 'trainannot'}"
    )


def photographs(images: Path, labels: Path) -> Iterator[Photograph]:
    """Yield each image in the folder `images` with the label image of the same name in `labels`, a
    PNG, by name.

    Raises UsageError if a folder or file is missing, is no image, has another size than its label,
    or if no label has any road.
    """
    for folder in (images, labels):
        if not folder.is_dir():
            raise UsageError(f"there is no folder {folder}: name the one that holds the images")

    paths = [path for path in sorted(images.iterdir()) if path.suffix in IMAGE_SUFFIXES]
    if not paths:
        raise UsageError(
            f"no *.png or *.jpg in {images}: put street photographs there, and their labels in "
            f"{labels}"
        )

    has_road = False
    for path in paths:
        photograph = _photograph(path, labels / f"{path.stem}.png")
        has_road |= bool(photograph.road.any())
        yield photograph

    if not has_road:
        raise UsageError(
            f"no pixel in {labels} is labelled {ROAD}, road: are these CamVid's labels in 12 "
            "classes?"
        )


def by_drive(shown: Iterable[Photograph]) -> dict[str, list[Photograph]]:
    """Return the photographs of each drive: its name is the part of theirs before the first _."""
    drives: dict[str, list[Photograph]] = {}
    for photograph in shown:
        name, _, _ = photograph.name.partition("_")
        drives.setdefault(name, []).append(photograph)

    return drives


def _photograph(path: Path, label_path: Path) -> Photograph:
    if not label_path.is_file():
        raise UsageError(f"{path} has no label {label_path}: add it or take the image out")

    image = _read(path, cv2.IMREAD_COLOR)
    label = _read(label_path, cv2.IMREAD_UNCHANGED)
    size = image.shape[:2]
    if label.shape != size or label.dtype != np.uint8:
        raise UsageError(
            f"the label {label_path} is {label.dtype} {label.shape}, but its image needs uint8 "
            f"{size}: make it anew from the labels of that image"
        )

    rgb = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    return Photograph(
        name=path.stem,
        image=rgb.astype(np.uint8, copy=False),
        label=label,
    )


def camvid_iou(weights: Path, images: Path, labels: Path) -> float:
    """Return the intersection over union of road, as found and as labelled, over all labelled
    pixels.

    Raises UsageError if the photographs cannot be read or none of them shows road, ConfigError if
    `weights` hold no road network.
    """
    segmenter = load(weights)
    return road_iou(segmenter.mask, photographs(images, labels))


def road_iou(found_in: Callable[[Bytes], Booleans], shown: Iterable[Photograph]) -> float:
    """Return the intersection over union of road, as `found_in` an image (h, w, 3) and as labelled,
    over all labelled pixels.
    """
    return _iou(found_in, ((each, each.road) for each in shown))


def building_iou(found_in: Callable[[Bytes], Booleans], shown: Iterable[Photograph]) -> float:
    """Return the intersection over union of buildings, as `road_iou` does of road."""
    return _iou(found_in, ((each, each.building) for each in shown))


def building_mask(segmenter: Segmenter, image: Bytes) -> Booleans:
    """Return which pixels of an RGB image (h, w, 3) are of any segment, (h, w), if no depth is
    known.
    """
    height, width, _ = image.shape
    camera = Calibration(
        width_px=width,
        height_px=height,
        fx_px=float(width),
        fy_px=float(width),
        cx_px=width / 2,
        cy_px=height / 2,
        baseline_m=0.1,
        mount_height_m=1.5,
        mount_forward_m=0.0,
    )
    mask = np.zeros((height, width), bool)
    for segment in segmenter.segments(image, np.zeros((height, width), np.float32), camera):
        mask |= segment.mask

    return mask


def _iou(
    found_in: Callable[[Bytes], Booleans], labelled: Iterable[tuple[Photograph, Booleans]]
) -> float:
    both_px = 0
    either_px = 0
    for photograph, wanted in labelled:
        found = found_in(photograph.image)
        both_px += int(np.count_nonzero(found & wanted & photograph.known))
        either_px += int(np.count_nonzero((found | wanted) & photograph.known))

    return both_px / max(either_px, 1)


def _read(path: Path, flags: int) -> npt.NDArray[Any]:
    data = np.fromfile(path, np.uint8)
    values = cv2.imdecode(data, flags) if data.size else None
    if values is None:
        raise UsageError(f"{path} is no image that can be read: put a PNG in its place")
    return values
