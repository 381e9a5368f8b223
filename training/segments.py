"""Trains the network that separates candidate objects (services/epam/recognition/segments.py)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.services.epam.recognition.look import (
    CHANNELS,
    FAR,
    WHOLE,
    Look,
    network_input,
    padded,
)
from cogmap.services.epam.recognition.segments import (
    OFFSET_PX,
    OUTPUT_SHAPES,
    Segment,
    far_beside,
    load,
)
from cogmap.training.crops import MIN_OVERLAP, overlap
from cogmap.training.networks.export import adopt, export
from cogmap.training.networks.loader import prefetch, shuffled
from cogmap.training.networks.optimizer import Optimizer, mixed_precision, seed_torch
from cogmap.training.networks.unet import UNet
from cogmap.training.rendering.reader import Town, files, read, towns

WIDTHS = (16, 48, 96, 160)
BATCH = 16
WEIGHT_DECAY = 1e-4
MIN_AREA_PX = 10
LARGE_SHARE = 0.01
MIXED_SHARE = 0.15


class Schedule(NamedTuple):
    """How often every example is used, and the largest rate of learning."""

    epochs: int
    max_rate: float


ANEW = Schedule(16, 3e-3)
# The layers of a network that is trained further are no longer normalized, which large steps need.
FURTHER = Schedule(8, 5e-4)


class SegmentationNet(nn.Module):
    """float32 (n, CHANNELS, h, w) to (n, 4, h, w): a U-Net at half the resolution, each pixel of
    which predicts four.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(CHANNELS, WIDTHS[0], 3, stride=2, padding=1)
        self.body = UNet(WIDTHS[0], 4 * 4, WIDTHS)
        self.finer = nn.PixelShuffle(2)

    def forward(self, values: Tensor) -> Tensor:
        """Return the output for `values`."""
        halved = functional.relu(self.stem(values))
        return self.finer(self.body(halved))


@dataclass(frozen=True, eq=False)
class Examples:
    """Network inputs, float16 (n, CHANNELS, h, w), and the number of the building at each pixel,
    uint8 (n, h, w), 0 for none.
    """

    values: npt.NDArray[np.float16]
    label: Bytes


def examples(towns: Iterable[Town], look: Look) -> Examples:
    """Return all views of `towns`, as a network sees them."""
    values = []
    labels = []
    *_, height, width = look.shape
    size = (width, height - 2 * look.padding_px)
    for town in towns:
        window = look.window(town.calibration)
        for image, depth_m, label in zip(town.left, town.stereo_m, town.label, strict=True):
            rows = window.rows
            small = cv2.resize(image[rows], size, interpolation=cv2.INTER_AREA).astype(np.uint8)
            small_m = cv2.resize(depth_m[rows], size, interpolation=cv2.INTER_NEAREST)
            example = network_input(small, small_m.astype(np.float32), town.calibration, window)
            values.append(example.astype(np.float16))
            labels.append(cv2.resize(label[rows], size, interpolation=cv2.INTER_NEAREST))

    return Examples(np.asarray(values), np.asarray(labels, np.uint8))


def target(label: Bytes) -> Singles:
    """Return what the network should predict for labels (h, w), float32 (5, h, w): building,
    centre, offset to the right and downwards, and the weight of the offset.
    """
    rows, columns = np.nonzero(label)
    number = label[rows, columns]
    wanted = np.zeros((5, *label.shape), np.float32)
    wanted[0] = label > 0

    # Of each number of the label: how many pixels show it, and the middle of these.
    size_px = np.bincount(number, minlength=1)
    is_large = size_px >= MIN_AREA_PX
    divisor = np.maximum(size_px, 1)
    centre_row = np.bincount(number, rows, minlength=1) / divisor
    centre_column = np.bincount(number, columns, minlength=1) / divisor

    # A bump at the centre of each large area, larger for a larger one.
    for large in np.flatnonzero(is_large):
        sd_px = np.clip(0.12 * np.sqrt(size_px[large]), 1.5, 5.0)
        height, width = label.shape
        down = _gaussian(height, centre_row[large], sd_px)
        across = _gaussian(width, centre_column[large], sd_px)
        np.maximum(wanted[1], np.outer(down, across), out=wanted[1])

    # A pixel has less weight, the larger its area; 1 on the mean.
    weight = is_large[number] / np.sqrt(divisor[number])
    scale = len(number) / max(float(weight.sum()), 1e-9)

    wanted[2, rows, columns] = (centre_column[number] - columns) / OFFSET_PX
    wanted[3, rows, columns] = (centre_row[number] - rows) / OFFSET_PX
    wanted[4, rows, columns] = weight * scale
    return wanted


def _gaussian(count: int, middle: float, sd: float) -> Floats:
    """Return a Gaussian of height 1 at 0, 1, and so on, (count,)."""
    squared = (np.arange(count) - middle) ** 2
    return np.asarray(np.exp(-squared / (2 * sd**2)))


def loss(output: Tensor, wanted: Tensor) -> Tensor:
    """Return the loss of the network's output (n, 4, h, w); small buildings have more weight than
    their pixels.
    """
    building = functional.binary_cross_entropy_with_logits(output[:, 0], wanted[:, 0])
    return building + instance_loss(output, wanted)


def instance_loss(output: Tensor, wanted: Tensor) -> Tensor:
    """Return the part of the loss that is about centres, and the offsets to them."""
    wanted_centre = wanted[:, 1]
    squared = (output[:, 1] - wanted_centre).square()
    centre = (squared * (1 + 8 * wanted_centre)).mean()

    weight = wanted[:, 4]
    error = (output[:, 2:4] - wanted[:, 2:4]).abs()
    offset = (error.sum(1) * weight).sum() / (weight.sum() + 1)

    return 20 * centre + 2 * offset


def augmented(
    values: npt.NDArray[np.float16], label: Bytes, rng: np.random.Generator
) -> tuple[Singles, Bytes]:
    """Return one example, perhaps mirrored, in another light, with less depth."""
    varied = values.astype(np.float32)
    if rng.random() < 0.5:
        varied[:7] = varied[:7, :, ::-1]
        label = label[:, ::-1]

    channel_gain = rng.normal(0, 0.08, (3, 1, 1))
    gain = np.exp(channel_gain + rng.normal(0, 0.12)).astype(np.float32)
    varied[:3] = (varied[:3] + 2) * gain - 2 + rng.normal(0, 0.05)

    # Depth is lost in some patches, and what follows from it.
    if rng.random() < 0.3:
        coarse = rng.random((15, 20), np.float32)
        height, width = label.shape
        field = cv2.resize(coarse, (width, height))
        varied[3:6, field < rng.uniform(0, 0.4)] = 0.0

    return varied, label


def train_on_renderings(
    folder: Path,
    out: Path,
    *,
    seed: int,
    epochs: int | None = None,
    start: Path | None = None,
    look: Look = WHOLE,
) -> dict[str, float]:
    """Train on the towns in `folder`/train and `folder`/blocks, from the weights in `start` on if
    there are any, write the network to `out`, or for a closer look beside it, and return the
    `metrics` of what is there then.

    Raises UsageError if there are no renderings, or `start` has other layers; ConfigError if it, or
    for a closer look `out`, holds no network that separates objects.
    """
    weights = out
    if look is FAR:
        load(out)
        weights = far_beside(out)

    seed_torch(seed)
    rng = np.random.default_rng(seed)
    net = SegmentationNet()
    schedule = ANEW
    if start is not None:
        load(start)
        adopt(net.eval(), start)
        schedule = FURTHER
    if epochs is not None:
        schedule = schedule._replace(epochs=epochs)

    with Progress() as progress:
        found = [*files(folder, "train"), *files(folder, "blocks")]
        paths = progress.track(found, description="reading")
        known = examples((read(path) for path in paths), look)
        net.to(memory_format=torch.channels_last)
        _fit(net, known, look, rng, schedule=schedule, progress=progress)

    export(net, weights, "seen", look.shape, OUTPUT_SHAPES)
    of_blocks = {
        f"blocks_{key}": value for key, value in metrics(folder, out, "blocks-val").items()
    }
    return metrics(folder, out, "val") | of_blocks


def _fit(
    net: SegmentationNet,
    known: Examples,
    look: Look,
    rng: np.random.Generator,
    *,
    schedule: Schedule,
    progress: Progress,
) -> None:
    steps = max(1, schedule.epochs * len(known.label) // BATCH)
    optimizer = Optimizer(net.parameters(), steps, schedule.max_rate, WEIGHT_DECAY)

    task = progress.add_task("training", total=steps)
    batches = partial(_batches, known, look, steps, rng)
    for values, wanted in prefetch(batches):
        batch = values.contiguous(memory_format=torch.channels_last)
        with mixed_precision():
            padded_output = net(batch).float()

        rows = padded_output.shape[2]
        output = padded_output[:, :, look.padding_px : rows - look.padding_px]
        value = optimizer.step(loss(output, wanted))
        progress.update(task, advance=1, description=f"training, loss {value:.3f}")


def _batches(
    known: Examples, look: Look, steps: int, rng: np.random.Generator
) -> Iterator[tuple[Singles, Singles]]:
    for chosen in shuffled(len(known.label), BATCH, steps, rng):
        inputs = []
        targets = []
        for number in chosen:
            values, label = augmented(known.values[number], known.label[number], rng)
            inputs.append(values)
            targets.append(target(label))

        yield padded(np.stack(inputs), look.padding_px), np.stack(targets)


def metrics(folder: Path, weights: Path, split: str) -> dict[str, float]:
    """Return the recall of buildings that cover at least LARGE_SHARE of a view in a split of
    `folder`, the precision of segments at least as large, and the share of all segments of which at
    least MIXED_SHARE is another building.
    """
    segmenter = load(weights)
    count = _Count()
    for town in towns(folder, split):
        for image, depth_m, label in zip(town.left, town.stereo_m, town.label, strict=True):
            segments = segmenter.segments(image, depth_m, town.calibration)
            count.add(segments, label)

    return {
        "recall": count.found / max(count.buildings, 1),
        "precision": count.correct / max(count.segments, 1),
        "mixed": count.mixed / max(count.all, 1),
    }


@dataclass
class _Count:
    """Of all views: the large buildings and how many of them were found, the large segments and how
    many of them are right, and all segments, and how many show two buildings.
    """

    buildings: int = 0
    found: int = 0
    segments: int = 0
    correct: int = 0
    all: int = 0
    mixed: int = 0

    def add(self, segments: list[Segment], label: Bytes) -> None:
        """Add a view with that `label` (h, w), in which `segments` were found."""
        min_area_px = LARGE_SHARE * label.size
        area_px = np.bincount(label.ravel())[1:]
        large = np.flatnonzero(area_px >= min_area_px) + 1
        self.buildings += len(large)

        matched = set()
        for segment in segments:
            building, share = overlap(segment, label)
            shown_px = np.bincount(label[segment.mask], minlength=3)[1:]
            second_px = np.partition(shown_px, -2)[-2]
            self.all += 1
            self.mixed += int(second_px > MIXED_SHARE * segment.area_px)
            is_match = share >= MIN_OVERLAP
            is_large = segment.area_px >= min_area_px
            self.segments += is_large
            self.correct += is_large and is_match
            if is_match:
                matched.add(building)

        self.found += len(matched & set(large.tolist()))
