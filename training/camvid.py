"""Trains the road network on a few street photographs with label images."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cogmap.services.epam.layout.road import CHANNELS
from cogmap.training.augment import Augmentation, LabelledImage
from cogmap.training.networks.photograph import COLOURS, PhotographNet
from cogmap.training.photographs import Photograph, photographs
from cogmap.training.road import Schedule, train, write

SIZE_PX = (240, 180)
WIDTHS = (8, 16, 32, 48, 64)
STRONG = Augmentation(
    zoom=(0.8, 2.0),
    shift=0.2,
    turn_deg=6.0,
    contrast=0.6,
    gamma=0.8,
    cast=0.25,
    brightness=30.0,
    noise=8.0,
    shadow_share=0.6,
    blur_share=0.5,
    slope=0.15,
    saturation=0.8,
    backlit_share=0.5,
)
# Few photographs: an epoch has many augmented images of each.
EPOCHS = 12
IMAGES = 960


def train_on_photographs(
    folder: Path, out: Path, *, seed: int, epochs: int | None = None, images: int | None = None
) -> None:
    """Train on `folder`/train with the labels in `folder`/trainannot, and write the network to
    `out`. An epoch has this number of augmented `images`.

    Raises UsageError if the photographs cannot be read.
    """
    read = photographs(folder / "train", folder / "trainannot")
    train_on(read, out, seed=seed, epochs=epochs, images=images)


def train_on(
    shown: Iterable[Photograph],
    out: Path,
    *,
    seed: int,
    epochs: int | None = None,
    images: int | None = None,
) -> None:
    """Train on photographs that were read, else as `train_on_photographs` does."""
    known = [
        LabelledImage.of(photograph.image, photograph.road, photograph.known, SIZE_PX)
        for photograph in shown
    ]

    schedule = Schedule(
        epochs=epochs or EPOCHS,
        images=images or IMAGES,
        seed=seed,
        augmentation=STRONG,
    )
    net = train(known, schedule, lambda: PhotographNet(CHANNELS - COLOURS, WIDTHS))
    write(net, out)
