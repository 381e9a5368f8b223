"""Trains the road network on street photographs with label images, few of them."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from training.augment import Augmentation, Sample
from training.photographs import Photograph, photographs
from training.road import Plan, export, train

SIZE_PX = (240, 180)
STRONG = Augmentation(
    zoom=(0.9, 2.0),
    shift=0.15,
    turn_deg=4.0,
    contrast=0.5,
    gamma=0.4,
    cast=0.15,
    brightness=30.0,
    noise=8.0,
    shadow_share=0.5,
    blur_share=0.3,
)
# Few photographs: an epoch is many variations of each.
EPOCHS = 12
SAMPLES = 960


def train_on_photographs(
    folder: Path, out: Path, seed: int, epochs: int = EPOCHS, samples: int = SAMPLES
) -> None:
    """Train on `folder`/train with the labels in `folder`/trainannot, and write the weights to
    `out`. An epoch is so many `samples`, variations of the photographs.

    Raises UsageError where the photographs cannot be read.
    """
    known = [
        _sample(photograph) for photograph in photographs(folder / "train", folder / "trainannot")
    ]
    export(train(known, Plan(epochs, samples, seed, STRONG)), out)


def _sample(photograph: Photograph) -> Sample:
    image, road, known = (
        cv2.resize(part, SIZE_PX, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
        for part in (
            photograph.image,
            photograph.road.astype(np.uint8) * 255,
            photograph.known.astype(np.uint8) * 255,
        )
    )
    return Sample(image, road, known)
