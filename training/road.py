"""Trains the road network (services/epam/layout/road.py) on renderings of towns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import torch
from rich.progress import Progress, track
from torch import Tensor, nn
from torch.nn import functional

from cogmap.geometry.arrays import Bytes, Singles
from cogmap.services.epam.layout.road import (
    CHANNELS,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    PADDING_PX,
    load,
    network_input,
)
from cogmap.training.augment import Augmentation, LabelledImage, augmented
from cogmap.training.networks.export import export
from cogmap.training.networks.loader import prefetch
from cogmap.training.networks.optimizer import Optimizer, seed_torch
from cogmap.training.networks.unet import UNet
from cogmap.training.photographs import BUILDING, OTHER, ROAD, Photograph, road_iou
from cogmap.training.rendering.reader import SURFACES, files, read

WIDTHS = (8, 16, 32, 48, 64, 64)
BATCH = 8
MAX_RATE = 4e-3
WEIGHT_DECAY = 0.02
WARM_UP = 0.15
EPOCHS = 4
# The class that each of SURFACES is among those of photographs.
CLASS = np.array(
    [{"road": ROAD, "building": BUILDING}.get(surface, OTHER) for surface in SURFACES], np.uint8
)


@dataclass(frozen=True)
class Schedule:
    """`epochs` of `images` augmented images each, in an order that follows from `seed`."""

    epochs: int
    images: int
    seed: int
    augmentation: Augmentation


def train_on_renderings(
    folder: Path, out: Path, *, seed: int, epochs: int | None = None
) -> dict[str, float]:
    """Train on the towns in `folder`/train, write the network to `out`, and return the IoU of road
    in `folder`/val.

    Raises UsageError if there are no renderings.
    """
    held_out = track(files(folder, "val"), "testing")
    training = track(files(folder, "train"), "reading")
    images = [LabelledImage.of(view.image, view.road, view.known) for view in _views(training)]

    schedule = Schedule(
        epochs=epochs or EPOCHS,
        images=len(images),
        seed=seed,
        augmentation=Augmentation(),
    )
    net = train(images, schedule, lambda: UNet(CHANNELS, 1, WIDTHS))
    write(net, out)
    return {"road_iou": road_iou(load(out).mask, _views(held_out))}


def _views(paths: Iterable[Path]) -> Iterator[Photograph]:
    """Yield all views of the towns in these files, with their road."""
    for path in paths:
        town = read(path)
        for image, surface in zip(town.left, town.surface, strict=True):
            yield Photograph(path.stem, image, CLASS[surface])


def train(
    images: Sequence[LabelledImage], schedule: Schedule, make_net: Callable[[], nn.Module]
) -> nn.Module:
    """Return the network of `make_net`, whose input and output are those of the road network,
    trained on augmented `images`.
    """
    seed_torch(schedule.seed)
    net = make_net().to(memory_format=torch.channels_last)

    steps = max(1, schedule.epochs * schedule.images // BATCH)
    optimizer = Optimizer(net.parameters(), steps, MAX_RATE, WEIGHT_DECAY, WARM_UP)
    net.train()

    batches = partial(_batches, images, schedule, steps)
    with Progress() as progress:
        task = progress.add_task("training", total=steps)
        for values, road, known in prefetch(batches):
            lost = loss(net, values, road, known)
            value = optimizer.step(lost)
            progress.update(task, advance=1, description=f"training, loss {value:.3f}")

    return net.eval()


def loss(net: nn.Module, values: Tensor, road: Tensor, known: Tensor) -> Tensor:
    """Return the mean cross entropy of the network's output for `values`, over the pixels that are
    `known` (n, h, w), where `road` (n, h, w) is right; both are shares of a pixel.
    """
    arranged = values.to(memory_format=torch.channels_last)
    padded = net(arranged)
    output = padded[:, 0, PADDING_PX:-PADDING_PX]
    of_pixels = functional.binary_cross_entropy_with_logits(output, road, reduction="none")

    return (of_pixels * known).sum() / known.sum().clamp(min=1)


def write(net: nn.Module, path: Path) -> None:
    """Write `net` to `path`, as `cogmap.services.epam.layout.road` reads it."""
    export(net, path, "image", INPUT_SHAPE, OUTPUT_SHAPES)


def _batches(
    images: Sequence[LabelledImage], schedule: Schedule, steps: int
) -> Iterator[tuple[Singles, Singles, Singles]]:
    rng = np.random.default_rng([schedule.seed, 0x60AD])

    # Each image once, in any order, then each once more.
    rounds = math.ceil(steps * BATCH / len(images))
    orders = [rng.permutation(len(images)) for _ in range(rounds)]
    order = np.concatenate(orders)[: steps * BATCH]

    for chosen in order.reshape(steps, BATCH):
        batch = [augmented(images[number], schedule.augmentation, rng) for number in chosen]
        pixels = np.stack([each.image for each in batch])
        road = _shares([each.road for each in batch])
        known = _shares([each.known for each in batch])

        yield network_input(pixels), road, known


def _shares(levels: Sequence[Bytes]) -> Singles:
    """Convert levels of 0 to 255 to shares of 0 to 1."""
    stacked = np.stack(levels).astype(np.float32)
    return stacked / np.float32(255)
