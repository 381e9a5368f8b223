"""Trains the road network: on renderings of towns, or on street photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import torch
from rich.progress import track
from torch import Tensor, nn

from services.epam.layout.road import (
    CHANNELS,
    INPUT_SHAPE,
    OUTPUT_SHAPES,
    PADDING_PX,
    load,
    network_input,
)
from training.augment import Augmentation, Bytes, Sample, plain, varied
from training.renderings import files, read
from training.unet import UNet, unet

WIDTHS = (8, 16, 32, 48, 64, 64)
BATCH = 8
STEEPEST_RATE = 4e-3
WEIGHT_DECAY = 0.02
EPOCHS = 4
ROAD = 2


@dataclass(frozen=True)
class Plan:
    """How long to train: `epochs` of `samples` variations each; one seed gives the same weights
    each time.
    """

    epochs: int
    samples: int
    seed: int
    how: Augmentation


def train_on_renderings(folder: Path, out: Path, seed: int, epochs: int = EPOCHS) -> float:
    """Train on the towns in `folder`/train and write the weights to `out`; the IoU of road in
    `folder`/val.

    Raises UsageError where there are no renderings.
    """
    held_out = files(folder, "val")
    samples = [
        _sample(image, surface)
        for path in track(files(folder, "train"), "reading")
        for image, surface in zip(*_views(path), strict=True)
    ]
    export(train(samples, Plan(epochs, len(samples), seed, Augmentation())), out)
    roads = load(out)
    both = 0
    either = 0
    for path in track(held_out, "testing"):
        for image, surface in zip(*_views(path), strict=True):
            found = roads.mask(image)
            road = surface == ROAD
            both += int(np.count_nonzero(found & road))
            either += int(np.count_nonzero(found | road))
    return both / max(either, 1)


def train(samples: Sequence[Sample], plan: Plan) -> UNet:
    """A road network that was trained on variations of `samples`, on one thread."""
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    torch.manual_seed(plan.seed)
    rng = np.random.default_rng([plan.seed, 0x60AD])
    network = unet(CHANNELS, 1, WIDTHS).to(memory_format=torch.channels_last)
    steps = max(1, plan.epochs * plan.samples // BATCH)
    optimizer = torch.optim.AdamW(network.parameters(), STEEPEST_RATE, weight_decay=WEIGHT_DECAY)
    rate = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, STEEPEST_RATE, total_steps=steps, pct_start=0.15
    )
    network.train()
    order = _order(len(samples), steps * BATCH, rng)
    for step in track(range(steps), "training"):
        batch = [
            varied(samples[number], plan.how, rng)
            for number in order[step * BATCH : (step + 1) * BATCH]
        ]
        optimizer.zero_grad()
        loss(network, batch).backward()
        optimizer.step()
        rate.step()
    return network.eval()


def loss(network: UNet, batch: Sequence[Sample]) -> Tensor:
    """The mean cross entropy between what `network` says of the known pixels of `batch` and what
    they show.
    """
    values = torch.from_numpy(network_input(np.stack([sample.image for sample in batch])))
    said = network(values.to(memory_format=torch.channels_last))[:, 0, PADDING_PX:-PADDING_PX]
    road, known = (
        torch.from_numpy(np.stack(parts).astype(np.float32) / 255)
        for parts in zip(*((sample.road, sample.known) for sample in batch), strict=True)
    )
    each = nn.functional.binary_cross_entropy_with_logits(said, road, reduction="none")
    return (each * known).sum() / known.sum().clamp(min=1)


def export(network: UNet, path: Path) -> None:
    """Write `network` to `path`, as `services.epam.layout.road` takes it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    example = (torch.zeros(INPUT_SHAPE),)
    torch.onnx.export(
        network.eval(),
        example,
        str(path),
        dynamo=False,
        opset_version=13,
        input_names=["image"],
        output_names=[*OUTPUT_SHAPES],
    )


def _views(path: Path) -> tuple[Bytes, Bytes]:
    """The images (n, h, w, 3) and the surfaces (n, h, w) in one file of renderings."""
    town = read(path)
    return town.left, town.surface


def _sample(image: Bytes, surface: Bytes) -> Sample:
    road = (surface == ROAD).astype(np.uint8) * 255
    return plain(Sample(image, road, np.full_like(road, 255)))


def _order(number: int, wanted: int, rng: np.random.Generator) -> npt.NDArray[np.intp]:
    """Which sample comes when: each once, in any order, then each once more."""
    rounds = -(-wanted // number)
    return np.concatenate([rng.permutation(number) for _ in range(rounds)])[:wanted]
