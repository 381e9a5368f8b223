"""Road and buildings found in street photographs that no network saw, after training on others."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np

from benchmarks.report import Metrics
from benchmarks.threshold import at_least
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.epam.public import road, segments
from cogmap.training.photographs import (
    Photograph,
    building_iou,
    building_mask,
    by_drive,
    photographs,
    road_iou,
    training_folders,
)

THRESHOLDS = {"camvid_iou": at_least(0.85)}
BY_DRIVE_THRESHOLDS = {
    "camvid_iou_other_drive": at_least(0.88),
    "camvid_building_iou_other_drive": at_least(0.75),
    "camvid_over_prior": at_least(0.1),
}
SEED = 0
PRIOR_SIZE_PX = (160, 120)
PRIOR_LEVELS = np.linspace(0.05, 0.95, 19)


def measure(camvid: Path, folder: Path) -> Metrics:
    """Train on CamVid's `train` photographs, and measure on its `val`; the weights go to `folder`.

    Raises UsageError if torch or the encoder's weights are not installed, or the photographs cannot
    be read.
    """
    training = _training()
    known = list(photographs(camvid / "train", camvid / "trainannot"))
    shown = list(photographs(camvid / "val", camvid / "valannot"))
    paths = folder / "road-camvid.onnx", folder / "segments-camvid.onnx"
    training.train_on(known, [], *paths, seed=SEED)

    road_found, building_found = _iou(*paths, shown)
    return {"camvid_iou": road_found, "camvid_building_iou": building_found}


def measure_by_drive(
    camvid: Path,
    folder: Path,
    announce: Callable[[str], None],
    *,
    epochs: int | None = None,
) -> Metrics:
    """Leave each drive out of the training once, and measure on it; the weights go to `folder`.
    Training has so many `epochs`, as that of `cogmap train road --camvid` if not given, and no
    renderings.

    `camvid_iou_other_drive` is the mean over drives, `camvid_prior_other_drive` that of one mask
    for all images of the drive left out, the mean of those of the others;
    `camvid_building_iou_other_drive` is of buildings. All stand there by drive too, and how long
    training took. Raises UsageError if torch or the encoder's weights are not installed, the
    photographs cannot be read, or are of a single drive.
    """
    image_folder, label_folder = training_folders(camvid)
    drives = by_drive(photographs(image_folder, label_folder))
    if len(drives) < 2:
        raise UsageError(
            f"all photographs in {image_folder} are of one drive, {', '.join(drives)}: a drive is "
            "what stands before the first _ of a file's name, add those of another"
        )

    training = _training()
    metrics: Metrics = {}
    for number, left_out in enumerate(drives, start=1):
        announce(f"[{number}/{len(drives)}] without {left_out}, {len(drives[left_out])} images")
        paths = (
            folder / f"road-without-{left_out}.onnx",
            folder / f"segments-without-{left_out}.onnx",
        )
        known = [each for name, of in drives.items() if name != left_out for each in of]
        began_s = time.monotonic()
        training.train_on(known, [], *paths, seed=SEED, epochs=epochs)
        took_s = time.monotonic() - began_s

        prior = _mask_iou(mean_mask(known), drives[left_out])
        road_found, building_found = _iou(*paths, drives[left_out])
        metrics[f"camvid_train_minutes_{left_out}"] = took_s / 60
        metrics[f"camvid_iou_{left_out}"] = road_found
        metrics[f"camvid_building_iou_{left_out}"] = building_found
        metrics[f"camvid_prior_{left_out}"] = prior

    # Each drive counts alike.
    means = {
        kind: float(np.mean([metrics[f"camvid_{kind}_{name}"] for name in drives]))
        for kind in ("iou", "building_iou", "prior")
    }
    return metrics | {
        "camvid_iou_other_drive": means["iou"],
        "camvid_building_iou_other_drive": means["building_iou"],
        "camvid_prior_other_drive": means["prior"],
        "camvid_over_prior": means["iou"] - means["prior"],
    }


def _training() -> ModuleType:
    """Return the module that trains on photographs. Raises UsageError if torch is not installed."""
    try:
        from cogmap.training import camvid
    except ImportError as error:
        raise UsageError(f"{error}: it trains a network first, run make train-setup") from None

    return camvid


def _iou(
    road_weights: Path, segments_weights: Path, shown: Sequence[Photograph]
) -> tuple[float, float]:
    """Return the IoU of road and that of buildings, as EPAM finds them without depth."""
    segmenter = segments.load(segments_weights)
    return (
        road_iou(road.load(road_weights).mask, shown),
        building_iou(partial(building_mask, segmenter), shown),
    )


def mean_mask(known: Sequence[Photograph]) -> Booleans:
    """Return the pixels (120, 160) that most images show as road: their share of the images is over
    the threshold that gives the highest IoU on these images.
    """
    road = sum(_small(photograph.road) for photograph in known)
    labelled = sum(_small(photograph.known) for photograph in known)
    share = np.asarray(road / np.maximum(labelled, 1e-6))

    masks = [np.asarray(share >= level) for level in PRIOR_LEVELS]
    return max(masks, key=lambda mask: _mask_iou(mask, known))


def _mask_iou(mask: Booleans, shown: Iterable[Photograph]) -> float:
    """Compute the IoU of road if each image shows it in `mask`."""

    def scaled(image: Bytes) -> Booleans:
        height, width, _ = image.shape
        levels = cv2.resize(mask.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
        return np.asarray(levels > 0)

    return road_iou(scaled, shown)


def _small(mask: Booleans) -> Singles:
    """Return the share of each of PRIOR_SIZE_PX pixels for which the mask is true."""
    shares = cv2.resize(mask.astype(np.float32), PRIOR_SIZE_PX, interpolation=cv2.INTER_AREA)
    return shares.astype(np.float32, copy=False)
