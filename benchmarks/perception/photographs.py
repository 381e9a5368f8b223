"""Road found in street photographs that the town's network never saw, after training on some."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from benchmarks.report import Metrics
from benchmarks.threshold import at_least
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Booleans, Bytes, Singles
from cogmap.services.epam.public import road
from cogmap.training.photographs import (
    Photograph,
    by_drive,
    camvid_iou,
    photographs,
    road_iou,
    training_folders,
)

THRESHOLDS = {"camvid_iou": at_least(0.85)}
BY_DRIVE_THRESHOLDS = {
    "camvid_iou_other_drive": at_least(0.88),
    "camvid_over_prior": at_least(0.1),
}
SEED = 0
PRIOR_SIZE_PX = (160, 120)
PRIOR_LEVELS = np.linspace(0.05, 0.95, 19)


def measure(camvid: Path, folder: Path) -> Metrics:
    """Train on CamVid's `train` photographs, and measure on its `val`; the weights go to `folder`.

    Raises UsageError if torch is not installed, or the photographs cannot be read.
    """
    weights = folder / "road-camvid.onnx"
    _train(photographs(camvid / "train", camvid / "trainannot"), weights)

    return {"camvid_iou": camvid_iou(weights, camvid / "val", camvid / "valannot")}


def measure_by_drive(
    camvid: Path,
    folder: Path,
    announce: Callable[[str], None],
    *,
    epochs: int | None = None,
    images: int | None = None,
) -> Metrics:
    """Leave each drive out of the training once, and measure on it; the weights go to `folder`.
    Training has `epochs` of that many `images`, as that of `cogmap train road --camvid` if not
    given.

    `camvid_iou_other_drive` is the mean over drives, `camvid_prior_other_drive` that of one mask
    for all images of the drive left out, the mean of those of the others. Both stand there by drive
    too, and how long training took. Raises UsageError if torch is not installed, the photographs
    cannot be read, or are of a single drive.
    """
    image_folder, label_folder = training_folders(camvid)
    drives = by_drive(photographs(image_folder, label_folder))
    if len(drives) < 2:
        raise UsageError(
            f"all photographs in {image_folder} are of one drive, {', '.join(drives)}: a drive is "
            "what stands before the first _ of a file's name, add those of another"
        )

    metrics: Metrics = {}
    for number, left_out in enumerate(drives, start=1):
        announce(f"[{number}/{len(drives)}] without {left_out}, {len(drives[left_out])} images")
        weights = folder / f"road-without-{left_out}.onnx"
        others = [shown for name, shown in drives.items() if name != left_out]
        known = list(chain.from_iterable(others))

        began_s = time.monotonic()
        _train(known, weights, epochs, images)
        took_s = time.monotonic() - began_s

        metrics[f"camvid_train_minutes_{left_out}"] = took_s / 60
        metrics[f"camvid_iou_{left_out}"] = road_iou(road.load(weights).mask, drives[left_out])
        metrics[f"camvid_prior_{left_out}"] = _mask_iou(mean_mask(known), drives[left_out])

    # Each drive counts alike.
    iou = float(np.mean([metrics[f"camvid_iou_{name}"] for name in drives]))
    prior = float(np.mean([metrics[f"camvid_prior_{name}"] for name in drives]))
    return metrics | {
        "camvid_iou_other_drive": iou,
        "camvid_prior_other_drive": prior,
        "camvid_over_prior": iou - prior,
    }


def _train(
    known: Iterable[Photograph],
    weights: Path,
    epochs: int | None = None,
    images: int | None = None,
) -> None:
    """Train on photographs. Raises UsageError if torch is not installed."""
    try:
        from cogmap.training.camvid import train_on
    except ImportError as error:
        raise UsageError(f"{error}: it trains a network first, run make train-setup") from None

    train_on(known, weights, seed=SEED, epochs=epochs, images=images)


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
